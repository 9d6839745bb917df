#pragma once

#include <filesystem>
#include <memory>

namespace demslam {

/// Serves the report page of a run that goes on: "/" is the page, "/events" a stream of server-sent events, "state"
/// with the page's data whenever they have changed and "end" when the run is over. On this machine alone (127.0.0.1).
/// Reads the run's files and nothing else.
class LiveServer {
 public:
  /// Port 0: any free one. Throws Error when the port is taken or demslam was built without the page.
  LiveServer(const std::filesystem::path& run, int port);
  /// Ends like finish(), without a last state.
  ~LiveServer();

  int port() const;
  /// The run is over: readers get its complete results, for which at most a few seconds are waited.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam
