"""Places of the training set: each is one short straight drive that is rendered under several suns.

A place is a pure function of its seed. Seeds from HELD_BACK on are never trained on.
"""
import random
from dataclasses import dataclass

HELD_BACK = 9000
SUN_TURNS_DEG = (0.0, 30.0, 75.0, 180.0)  # the day-cycle: the same drive with the sun's azimuth turned by these


@dataclass(frozen=True)
class Place:
    seed: int
    text: str  # scene TOML with {elevation} and {azimuth} open
    suns_deg: tuple  # (elevation, azimuth) of each visit

    def scene(self, visit):
        elevation, azimuth = self.suns_deg[visit]
        return self.text.format(elevation=elevation, azimuth=azimuth)


TEMPLATE = """seed = {seed}
[terrain]
relief = "{relief}"
size_m = 120.0
roughness = {roughness:.3f}
crater_density = {craters:.3f}
rock_abundance = {rocks:.4f}
rock_max_m = 0.8
albedo_variation = {albedo:.3f}
[light]
sun_elevation_deg = {{elevation:.2f}}
sun_azimuth_deg = {{azimuth:.2f}}
soil = "{soil}"
[camera]
width_px = {size}
height_px = {size}
horizontal_fov_deg = {fov:.2f}
height_m = {height:.3f}
pitch_down_deg = {pitch:.2f}
baseline_m = {baseline:.3f}
blur_px = {blur:.3f}
[rover]
route = "straight"
heading_deg = {heading:.2f}
length_m = {length:.3f}
speed_m_per_s = {spacing:.3f}
[output]
depth = true
"""


def place(seed, frames=8, size=320):
    draw = random.Random(seed)
    spacing = draw.uniform(0.2, 0.42)
    text = TEMPLATE.format(
        seed=seed, size=size, relief=draw.choice(["mare", "mid", "highland"]), roughness=draw.uniform(0.6, 1.4),
        craters=draw.uniform(0.6, 1.5), rocks=draw.uniform(0.005, 0.08), albedo=draw.uniform(0.02, 0.08),
        soil=draw.choice(["regolith", "mare", "highland"]), fov=draw.uniform(42.0, 88.0),
        height=draw.uniform(0.8, 1.8), pitch=draw.uniform(14.0, 32.0), baseline=draw.uniform(0.12, 0.35),
        blur=draw.uniform(0.4, 0.8), heading=draw.uniform(0.0, 360.0), spacing=spacing,
        length=spacing * (frames - 1) + 1e-3)
    azimuth = draw.uniform(0.0, 360.0)
    suns = tuple((draw.uniform(6.0, 50.0), (azimuth + turn + draw.uniform(-10.0, 10.0)) % 360.0)
                 for turn in SUN_TURNS_DEG)
    return Place(seed, text, suns)
