// demslam: one binary; each sub-command parses, calls one function of the library, prints.

#include <fmt/format.h>
#include <malloc.h>

#include <csignal>
#include <cstdlib>
#include <exception>
#include <new>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/base/version.h"

namespace demslam::apps {

std::stop_source& interrupt() {
  static std::stop_source source;
  return source;
}

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// The first signal asks the work to stop and leave valid results; the second ends the program at once.
void on_signal(int signal) {
  if (interrupted != 0) std::_Exit(128 + signal);
  interrupted = signal;
  interrupt().request_stop();
}

void install_signal_handlers() {
  interrupt();  // constructed before a signal can arrive
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

int fail(const char* what) {
  fmt::print(stderr, "demslam: error: {}\n", what);
  return EXIT_FAILURE;
}

int run(int argc, char** argv) {
  CLI::App app{"demslam: stereo visual SLAM for planetary rovers, anchored to orbital elevation maps", "demslam"};
  app.set_version_flag("--version", std::string("demslam ") + kVersion);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);
  app.footer(
      "Start here:\n  demslam simulate configs/demo.toml -o runs/data\n  demslam run runs/data -o runs/anchored\n"
      "  demslam evaluate runs/anchored");
  add_simulate(app);
  add_run(app);
  add_replay(app);
  add_evaluate(app);
  add_dataset(app);
  add_dem(app);
  add_experiment(app);
  add_map(app);
  add_results_export(app);
  add_report(app);
  add_models(app);
  CLI11_PARSE(app, argc, argv);
  return interrupted != 0 ? 128 + interrupted : EXIT_SUCCESS;
}

}  // namespace
}  // namespace demslam::apps

int main(int argc, char** argv) {
  using namespace demslam::apps;
  // One arena for all threads: memory that the thread of a batch frees serves the run again. At 100 km the peak is 963
  // MB instead of 1,271; no command was measured to be slower.
  mallopt(M_ARENA_MAX, 1);
  install_signal_handlers();
  try {
    return run(argc, argv);
  } catch (const demslam::Error& error) {
    return fail(error.what());
  } catch (const std::bad_alloc&) {
    return fail("out of memory");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}
