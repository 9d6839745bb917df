#pragma once

#include <string>

#include "demslam/evaluation/table.h"

namespace demslam {

/// For a page of docs/; the title is left out.
std::string markdown_table(const Table& table);

}  // namespace demslam
