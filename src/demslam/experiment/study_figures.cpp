#include "demslam/experiment/study_figures.h"

#include <algorithm>

#include "demslam/base/text.h"
#include "demslam/report/run_plots.h"

namespace demslam {

namespace fs = std::filesystem;

void write_study_figures(const Study& study, const fs::path& out) {
  for (const StudyDrive& drive : study.drives) {
    const fs::path folder = study_folder(out, drive, study.seeds.front());
    std::vector<fs::path> runs;
    for (const StudyVariant& variant : study.variants) runs.push_back(folder / variant.name);
    if (!std::ranges::all_of(runs, [](const fs::path& run) { return fs::exists(run / "summary.json"); })) continue;
    const Report report = read_report(runs, std::nullopt, folder / "data" / "dem.tif");
    write_map_picture(report, out / (drive.name + "_map.png"));
    write_text(out / (drive.name + "_error.svg"), error_plot(report, study.title + ": error, no alignment"));
    const Report recording = read_report({folder / "recording"}, std::nullopt, std::nullopt);
    write_text(out / (drive.name + "_cost.svg"), cost_plot(recording.runs.front(), study.title + ": cost of odometry"));
  }
}

}  // namespace demslam
