#pragma once

#include <filesystem>
#include <vector>

#include "demslam/dem/local_frame.h"
#include "demslam/geometry/trajectory.h"

namespace demslam {

/// A position on a body: satellite navigation on WGS84, or on the body of the DEM's own CRS.
struct GeodeticFix {
  TimestampNs t_ns = 0;  ///< RTKLIB: GPS time (no leap seconds) as if it were UTC, since 1970
  double longitude_deg = 0.0, latitude_deg = 0.0;
  double height_m = 0.0;  ///< above the ellipsoid
  int quality = 1;        ///< RTKLIB: 1 fixed, 2 float, 5 single
};

struct GeodeticFile {
  std::vector<GeodeticFix> fixes;
  bool wgs84 = true;  ///< else on the body of the DEM's CRS
};

/// Is this a .pos file, or a CSV with longitude and latitude in its header?
bool is_geodetic(const std::filesystem::path& file);

/// Reads either. The CSV's header names its columns, in any order: a time (t_ns, timestamp [ns], time_s, ...; in
/// nanoseconds where the name says ns or the numbers cannot be seconds), longitude or lon, latitude or lat, height or
/// altitude or alt; others are not read. Throws Error with file and line.
GeodeticFile read_geodetic(const std::filesystem::path& file);

/// An RTKLIB .pos file with calendar time and latitude, longitude, height (S3LI's global_lle.pos).
/// Throws Error with file and line; a .pos of baselines (x, y, z or e, n, u) is refused.
std::vector<GeodeticFix> read_pos(const std::filesystem::path& file);

struct GeodeticOptions {
  int worst_quality = 1;            ///< fixes of a larger Q are left out
  double geoid_undulation_m = 0.0;  ///< geoid above the ellipsoid, where the DEM's heights count from the geoid
};

/// Positions in the map of a DEM; rotations are the identity, for none are known (has_rotation() says so).
/// The DEM's CRS must be on WGS84. Throws Error when no fix is good enough.
Trajectory positions_in_map(const std::vector<GeodeticFix>& fixes, const Georeference& georeference,
                            const GeodeticOptions& options = {});

}  // namespace demslam
