#include "demslam/base/memory.h"

#include <unistd.h>

#include <fstream>

namespace demslam {

double resident_mib() {
  std::ifstream statm("/proc/self/statm");
  double whole_pages = 0.0, resident_pages = 0.0;
  statm >> whole_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

}  // namespace demslam
