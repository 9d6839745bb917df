#include "demslam/report/live_server.h"

#include <atomic>
#include <thread>

#include "demslam/base/error.h"
#include "demslam/report/live_report.h"

#include <httplib.h>  // behind Eigen, whose names its system headers define as macros

namespace demslam {
namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr std::chrono::milliseconds kLook(200), kFarewell(5000);

/// A port that another server listens on is not shared with it, which httplib would do by itself.
void claim_alone(socket_t socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

std::string event(const char* name, const std::string& data) {
  return std::string("event: ") + name + "\ndata: " + data + "\n\n";
}

}  // namespace

struct LiveServer::State {
  LiveReport report;
  httplib::Server server;
  int port = 0;
  std::thread thread;
  std::atomic<int> readers = 0;
  std::atomic<bool> ended = false, stopped = false;

  explicit State(const std::filesystem::path& run) : report(run) {
    server.Get("/", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(page_with(*report.state().data), "text/html");
    });
    server.Get("/events", [this](const httplib::Request&, httplib::Response& response) {
      response.set_header("Cache-Control", "no-store");
      ++readers;
      response.set_chunked_content_provider(
          "text/event-stream",
          [this, sent = std::size_t{0}](std::size_t, httplib::DataSink& sink) mutable { return send(sink, sent); },
          [this](bool) { --readers; });
    });
  }

  /// One look at the run; false ends the stream.
  bool send(httplib::DataSink& sink, std::size_t& sent) {
    if (stopped || !sink.is_writable()) return false;
    const bool last = ended;
    const LiveState now = last ? report.last_state() : report.state();
    std::string text = now.number == sent ? std::string(": still here\n\n") : event("state", *now.data);
    sent = now.number;
    if (last) text += event("end", "{}");
    if (!sink.write(text.data(), text.size())) return false;
    if (last) sink.done();
    for (int looks = 0; looks < 5 && !last && !ended && !stopped; ++looks) std::this_thread::sleep_for(kLook);
    return true;
  }

  void stop() {
    stopped = true;
    server.stop();
    if (thread.joinable()) thread.join();
  }
};

LiveServer::LiveServer(const std::filesystem::path& run, int port) : state_(std::make_unique<State>(run)) {
  page_with("");  // is there one?
  httplib::Server& server = state_->server;
  server.set_socket_options(claim_alone);
  state_->port = port == 0 ? server.bind_to_any_port(kHost) : server.bind_to_port(kHost, port) ? port : -1;
  if (state_->port < 0) {
    throw Error("--live: port " + std::to_string(port) + " cannot be had (in use?); name another one, or 0 for any");
  }
  state_->thread = std::thread([&server] { server.listen_after_bind(); });
  server.wait_until_ready();
}

LiveServer::~LiveServer() { state_->stop(); }

int LiveServer::port() const { return state_->port; }

void LiveServer::finish() {
  state_->ended = true;
  const auto patience_ends = std::chrono::steady_clock::now() + kFarewell;
  while (state_->readers > 0 && std::chrono::steady_clock::now() < patience_ends) std::this_thread::sleep_for(kLook);
}

}  // namespace demslam
