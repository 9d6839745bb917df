#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace demslam {

/// A prepared statement. Parameters count from 1, columns from 0.
class Statement {
 public:
  Statement(sqlite3* database, std::string_view sql);

  Statement& bind(int parameter, std::int64_t value);
  Statement& bind(int parameter, std::size_t value) { return bind(parameter, static_cast<std::int64_t>(value)); }
  Statement& bind(int parameter, int value) { return bind(parameter, static_cast<std::int64_t>(value)); }
  Statement& bind(int parameter, double value);
  Statement& bind_text(int parameter, std::string_view text);
  /// The bytes must live until the statement has run.
  Statement& bind_blob(int parameter, std::string_view bytes);
  Statement& bind_null(int parameter);

  /// Fetches the next row; after the last one the statement is ready to be bound and run again.
  bool step();
  /// Runs to the end.
  void run();
  /// The first row as `read` makes it, or nothing; then the statement is ready again, even when `read` throws.
  template <class Read>
  auto first(Read read) -> std::optional<decltype(read(*this))> {
    const Rewind rewind{this};
    if (!step()) return std::nullopt;
    return read(*this);
  }

  std::int64_t integer(int column) const;
  std::size_t index(int column) const { return static_cast<std::size_t>(integer(column)); }
  double real(int column) const;
  bool is_null(int column) const;
  /// Text or blob, valid until the next step.
  std::string_view bytes(int column) const;
  std::string string(int column) const { return std::string(bytes(column)); }

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  struct Rewind {
    Statement* statement;
    ~Rewind() { statement->reset(); }
  };
  void reset();
  [[noreturn]] void fail();

  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

enum class OpenMode { create, write, read };

/// What stands in the first bytes of an SQLite file.
struct FileHeader {
  std::uint32_t page_bytes = 0, schema = 0, application = 0;
};

/// One connection to one SQLite file. Every failure is a demslam::Error that names the file and says what to do.
class Database {
 public:
  Database(const std::filesystem::path& file, OpenMode mode);

  /// Read from the file itself, before SQLite reads, locks or recovers anything; nothing when it is no SQLite file.
  std::optional<FileHeader> header() const;
  std::int64_t file_bytes() const;
  bool is_read_only() const;
  /// Off: closing leaves a write-ahead log as it is.
  void checkpoint_on_close(bool on);

  void execute(const std::string& sql);
  Statement prepare(std::string_view sql) { return {database_.get(), sql}; }
  std::int64_t integer(std::string_view sql);
  std::string string(std::string_view sql);

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::unique_ptr<sqlite3, Close> database_;
};

/// All or nothing: rolls back unless committed.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) { database_.execute("BEGIN IMMEDIATE"); }
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  void commit();

 private:
  Database& database_;
  bool committed_ = false;
};

}  // namespace demslam
