#include "demslam/store/sqlite.h"

#include <sqlite3.h>

#include <array>
#include <cstring>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr int kBusyTimeoutMs = 2000;  // a reader's recovery or a checkpoint; another run is told by its lock

std::string advice(int code) {
  switch (code & 0xff) {
    case SQLITE_CORRUPT:
      return "is damaged; restore a copy, or remove it and run again";
    case SQLITE_NOTADB:
      return "is not a demslam map";
    case SQLITE_FULL:
    case SQLITE_IOERR:
      return "cannot be written or read (disk full?); everything up to the last keyframe is kept, free some space and "
             "resume";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "is in use by another run; wait for it or choose another run folder";
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return "cannot be opened; check that it exists and that its folder may be written";
    default:
      return "failed";
  }
}

[[noreturn]] void throw_error(sqlite3* database, int code) {
  throw Error(std::string(sqlite3_db_filename(database, "main")) + ": " + advice(code) +
              " (SQLite: " + sqlite3_errmsg(database) + ")");
}

void check(sqlite3* database, int code) {
  if (code != SQLITE_OK) throw_error(database, code);
}

std::uint32_t big_endian(const unsigned char* bytes, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | bytes[i];
  return value;
}

/// Readers too may finish what a killed writer has begun; where they may not write, SQLite falls back to reading.
int flags(OpenMode mode) {
  return SQLITE_OPEN_EXRESCODE | SQLITE_OPEN_READWRITE | (mode == OpenMode::create ? SQLITE_OPEN_CREATE : 0);
}

sqlite3_file* file_of(sqlite3* database) {
  sqlite3_file* file = nullptr;
  check(database, sqlite3_file_control(database, "main", SQLITE_FCNTL_FILE_POINTER, &file));
  return file;
}

}  // namespace

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement::Statement(sqlite3* database, std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  check(database, sqlite3_prepare_v3(database, sql.data(), static_cast<int>(sql.size()), SQLITE_PREPARE_PERSISTENT,
                                     &statement, nullptr));
  statement_.reset(statement);
}

void Statement::fail() {
  sqlite3* database = sqlite3_db_handle(statement_.get());
  const int code = sqlite3_extended_errcode(database);
  try {
    throw_error(database, code);
  } catch (...) {
    reset();  // after the message is made: a reset replaces it
    throw;
  }
}

Statement& Statement::bind(int parameter, std::int64_t value) {
  if (sqlite3_bind_int64(statement_.get(), parameter, value) != SQLITE_OK) fail();
  return *this;
}

Statement& Statement::bind(int parameter, double value) {
  if (sqlite3_bind_double(statement_.get(), parameter, value) != SQLITE_OK) fail();
  return *this;
}

Statement& Statement::bind_text(int parameter, std::string_view text) {
  if (sqlite3_bind_text64(statement_.get(), parameter, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8) !=
      SQLITE_OK) {
    fail();
  }
  return *this;
}

Statement& Statement::bind_blob(int parameter, std::string_view bytes) {
  const char* data = bytes.empty() ? "" : bytes.data();  // a null pointer would bind NULL
  if (sqlite3_bind_blob64(statement_.get(), parameter, data, bytes.size(), SQLITE_STATIC) != SQLITE_OK) fail();
  return *this;
}

Statement& Statement::bind_null(int parameter) {
  if (sqlite3_bind_null(statement_.get(), parameter) != SQLITE_OK) fail();
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) fail();
  sqlite3_reset(statement_.get());
  return false;
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

void Statement::run() {
  while (step()) {
  }
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }
bool Statement::is_null(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }

std::string_view Statement::bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

void Database::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

Database::Database(const std::filesystem::path& file, OpenMode mode) {
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &database, flags(mode), nullptr);
  database_.reset(database);
  if (code != SQLITE_OK) {
    throw Error(file.string() + ": " + advice(code) + " (SQLite: " + sqlite3_errstr(code) + ")");
  }
  check(database, sqlite3_busy_timeout(database, kBusyTimeoutMs));
  if (mode == OpenMode::read) execute("PRAGMA query_only = ON");
}

std::optional<FileHeader> Database::header() const {
  constexpr std::size_t kHeaderBytes = 100;  // www.sqlite.org/fileformat.html, 1.3
  std::array<unsigned char, kHeaderBytes> bytes{};
  sqlite3_file* file = file_of(database_.get());
  if (file->pMethods->xRead(file, bytes.data(), kHeaderBytes, 0) != SQLITE_OK) return std::nullopt;
  if (std::memcmp(bytes.data(), "SQLite format 3", 16) != 0) return std::nullopt;
  const std::uint32_t page = big_endian(&bytes[16], 2);
  return FileHeader{page == 1 ? 65536 : page, big_endian(&bytes[60], 4), big_endian(&bytes[68], 4)};
}

std::int64_t Database::file_bytes() const {
  sqlite3_int64 size = 0;
  sqlite3_file* file = file_of(database_.get());
  check(database_.get(), file->pMethods->xFileSize(file, &size));
  return size;
}

bool Database::is_read_only() const { return sqlite3_db_readonly(database_.get(), "main") == 1; }

void Database::checkpoint_on_close(bool on) {
  check(database_.get(), sqlite3_db_config(database_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, on ? 0 : 1, nullptr));
}

void Database::execute(const std::string& sql) {
  const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  check(database_.get(), code);
}

std::int64_t Database::integer(std::string_view sql) {
  return prepare(sql).first([](const Statement& row) { return row.integer(0); }).value_or(0);
}

std::string Database::string(std::string_view sql) {
  return prepare(sql).first([](const Statement& row) { return row.string(0); }).value_or("");
}

Transaction::~Transaction() {
  if (committed_) return;
  try {
    database_.execute("ROLLBACK");
  } catch (const std::exception&) {  // SQLite has already rolled back, as it does when the disk is full
  }
}

void Transaction::commit() {
  database_.execute("COMMIT");
  committed_ = true;
}

}  // namespace demslam
