#pragma once

#include <cstdint>

namespace demslam {

/// Rays are cast in small blocks of pixels: coherent enough for sixteen at a time.
inline constexpr int kAcross = 4, kDown = 4, kPacket = kAcross * kDown;

enum class Surface : std::uint8_t { sky, ground, rock };

/// Three coordinates of a packet's points or directions.
struct alignas(64) Triples {
  float x[kPacket], y[kPacket], z[kPacket];
};

/// The visible points of a packet, ready to be lit.
struct alignas(64) Hits {
  Triples position;          ///< relative to the scene's origin
  Triples normal;            ///< unit; of the shading
  Triples to_eye;            ///< unit
  float albedo[kPacket];     ///< relative to the ground's
  float footprint[kPacket];  ///< width of a pixel there, metres
  float offset[kPacket];     ///< shadow rays start this far off the surface
  Surface surface[kPacket];
};

inline void dot(const Triples& a, const Triples& b, float* out) {
  for (int i = 0; i < kPacket; ++i) out[i] = a.x[i] * b.x[i] + a.y[i] * b.y[i] + a.z[i] * b.z[i];
}

}  // namespace demslam
