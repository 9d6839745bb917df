#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "demslam/dem/dem.h"
#include "demslam/report/internal/images.h"
#include "demslam/report/report_page.h"

namespace demslam {

/// What the runs of a page share.
struct PageContext {
  PageOptions share;  ///< of one run: options divided by the number of runs
  const Dem* dem = nullptr;
  ImageTable* images = nullptr;
  std::vector<std::string>* notes = nullptr;
};

/// One entry of the page's "runs" (docs/report.md).
nlohmann::ordered_json run_json(const ReportRun& run, const PageContext& context);

}  // namespace demslam
