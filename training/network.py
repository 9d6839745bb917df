"""The network: grey image -> descriptors, keypoint logits and reliability at an eighth of the resolution.

Its outputs are those of the contract "xfeat" (docs/models.md), so the product decodes them as it decodes XFeat's.
"""
import copy

import torch
import torch.nn.functional as F
from torch import nn

WIDTH = 64
CELL = 8
EAGERNESS = 3.0  # off the logit of "no keypoint" in use: many doubtful keypoints match better than few sure ones


def convolution(inputs, outputs, stride=1, size=3):
    return nn.Sequential(nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False), nn.BatchNorm2d(outputs),
                         nn.ReLU(inplace=True))


def without_exposure(grey):
    """Local mean off, local contrast to one, over some 40 pixels: exposure, shade and gamma are mostly gone."""
    def around(maps):
        return F.avg_pool2d(F.avg_pool2d(maps, CELL), 5, 1, 2, count_include_pad=False)
    mean = around(grey)
    deviation = (around(grey * grey) - mean * mean).clamp(min=0.0).sqrt()
    maps = F.interpolate(torch.cat([mean, deviation], 1), scale_factor=float(CELL), mode="bilinear",
                         align_corners=False)
    return (grey - maps[:, :1]) / (maps[:, 1:] + 0.02)


class Lunar(nn.Module):
    def __init__(self):
        super().__init__()
        self.at_2 = convolution(1, 12, 2)
        self.at_4 = nn.Sequential(convolution(12, 32, 2), convolution(32, 32))
        self.at_8 = nn.Sequential(convolution(32, WIDTH, 2), convolution(WIDTH, WIDTH), convolution(WIDTH, WIDTH))
        self.at_16 = nn.Sequential(convolution(WIDTH, WIDTH, 2), convolution(WIDTH, WIDTH),
                                       convolution(WIDTH, WIDTH))
        self.at_32 = nn.Sequential(convolution(WIDTH, WIDTH, 2), convolution(WIDTH, WIDTH),
                                           convolution(WIDTH, WIDTH))
        self.fuse = convolution(WIDTH, WIDTH)
        self.descriptor = nn.Conv2d(WIDTH, WIDTH, 1)
        self.reliability = nn.Conv2d(WIDTH, 1, 1)
        self.keypoints = nn.Sequential(convolution(12 * 16 + 32 * 4 + WIDTH, 96, size=1),
                                       nn.Conv2d(96, CELL * CELL + 1, 1))

    def forward(self, image):
        """image [B, 3 or 1, H, W] in 0..1, H and W multiples of 32."""
        at_2 = self.at_2(without_exposure(image[:, :1]))
        at_4 = self.at_4(at_2)
        at_8 = self.at_8(at_4)
        at_16 = self.at_16(at_8)
        fused = self.fuse(at_8 + up(at_16, 2) + up(self.at_32(at_16), 4))
        fine = torch.cat([F.pixel_unshuffle(at_2, 4), F.pixel_unshuffle(at_4, 2), at_8], 1)
        return self.descriptor(fused), self.keypoints(fine), torch.sigmoid(self.reliability(fused))


def for_use(network):
    """A copy as the product runs it."""
    ready = copy.deepcopy(network).eval()
    with torch.no_grad():
        ready.keypoints[1].bias[CELL * CELL] -= EAGERNESS
    return ready


def up(maps, factor):
    return F.interpolate(maps, scale_factor=float(factor), mode="bilinear", align_corners=False)


def sample(maps, pixels, width, height):
    """Values at pixels [B, N, 2], read as the product reads them; [B, N, channels]."""
    size = torch.tensor([width - 1, height - 1], dtype=torch.float32, device=pixels.device)
    grid = (2.0 * pixels / size - 1.0)[:, :, None]
    return F.grid_sample(maps, grid, mode="bicubic", align_corners=False)[..., 0].transpose(1, 2)
