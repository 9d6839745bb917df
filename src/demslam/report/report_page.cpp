#include "demslam/report/report_page.h"

#include <string_view>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/report/internal/embedded_page.h"

namespace demslam {

std::string page_with(const std::string& data) {
  constexpr std::string_view kMark = "@@DEMSLAM_DATA@@";
  const std::string_view page = embedded_page();
  const std::size_t mark = page.find(kMark);
  if (mark == std::string_view::npos) {
    throw Error(
        "report: this demslam was built without its report page, which needs npm (docs/report.md); install npm and "
        "build "
        "again, or name the report *.png");
  }
  std::string html(page.substr(0, mark));
  return html.append(data).append(page.substr(mark + kMark.size()));
}

void write_html(const Report& report, const std::filesystem::path& file, const PageOptions& options) {
  write_text(file, page_with(page_data(report, options)));
}

}  // namespace demslam
