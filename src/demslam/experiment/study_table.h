#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "demslam/experiment/published.h"
#include "demslam/experiment/study.h"

namespace demslam {

/// One row per drive and variant (median over seeds), the published figures beside them where there are some.
std::string study_markdown(const Study& study, const std::vector<StudyScore>& scores,
                           const std::vector<PublishedRow>& published);
std::string study_latex(const Study& study, const std::vector<StudyScore>& scores);
std::string scores_csv(const std::vector<StudyScore>& scores);
std::string scores_json(const Study& study, const std::vector<StudyScore>& scores);

/// table.md, table.tex, scores.csv, scores.json in `out`.
void write_study(const Study& study, const std::vector<StudyScore>& scores, const std::vector<PublishedRow>& published,
                 const std::filesystem::path& out);

}  // namespace demslam
