#pragma once

namespace demslam {

/// What the process holds in memory at this moment (resident set), MiB; 0 where the system does not say.
double resident_mib();

}  // namespace demslam
