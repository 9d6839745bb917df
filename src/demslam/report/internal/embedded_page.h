#pragma once

#include <string_view>

namespace demslam {

/// The page that cmake/DemslamWeb.cmake builds from web/, with a mark where the data go; empty where it could not be
/// built.
std::string_view embedded_page();

}  // namespace demslam
