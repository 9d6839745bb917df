"""The matcher: keypoints and descriptors of two pictures -> what shows the same point of the ground in both.

LightGlue's design (Lindenberger, Sarlin, Pollefeys, ICCV 2023), narrow, of few layers, without early exits. It begins
as the dual softmax of the descriptors' cosines and learns what to add to that.
"""
import torch
import torch.nn.functional as F
from torch import nn

WIDTH = 64
HEADS = 2
LAYERS = 4
SHARPNESS = 16.0  # of the dual softmax it begins as: what the extractor was trained with (train.py)


NEVER = -1e4  # of a logit


def heads(rows, channels=WIDTH // HEADS):
    """[..., N, HEADS * channels] -> [..., HEADS, N, channels]."""
    return rows.reshape(*rows.shape[:-2], -1, HEADS, channels).transpose(-3, -2)


def attend(queries, keys, values, real):
    logits = (WIDTH / HEADS) ** -0.5 * queries @ keys.transpose(-2, -1)
    if real is not None:
        logits = logits.masked_fill(~real[..., None, None, :], NEVER)
    told = (logits.softmax(-1) @ values).transpose(-3, -2)
    return told.reshape(*told.shape[:-3], -1, WIDTH)


def turned(rows, cosine, sine):
    """Channels taken in pairs and turned: products of two such rows see where one lies from the other."""
    x, y = rows.chunk(2, -1)
    return torch.cat([x * cosine - y * sine, x * sine + y * cosine], -1)


class Update(nn.Module):
    """What a point makes of what it was told; nothing at first."""
    def __init__(self):
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(2 * WIDTH, 2 * WIDTH), nn.LayerNorm(2 * WIDTH), nn.GELU(),
                                    nn.Linear(2 * WIDTH, WIDTH))
        nn.init.zeros_(self.layers[3].weight)
        nn.init.zeros_(self.layers[3].bias)

    def forward(self, rows, told):
        return rows + self.layers(torch.cat([rows, told], -1))


class Within(nn.Module):
    """Points of one picture look at each other."""
    def __init__(self):
        super().__init__()
        self.queries, self.keys, self.values = (nn.Linear(WIDTH, WIDTH) for _ in range(3))
        self.update = Update()

    def forward(self, rows, turn, real):
        queries, keys = turned(heads(self.queries(rows)), *turn), turned(heads(self.keys(rows)), *turn)
        return self.update(rows, attend(queries, keys, heads(self.values(rows)), real))


class Across(nn.Module):
    """Points of either picture look at those of the other."""
    def __init__(self):
        super().__init__()
        self.keys, self.values = nn.Linear(WIDTH, WIDTH), nn.Linear(WIDTH, WIDTH)
        self.update = Update()

    def forward(self, rows_a, rows_b, real_a, real_b):
        keys_a, keys_b = heads(self.keys(rows_a)), heads(self.keys(rows_b))
        values_a, values_b = heads(self.values(rows_a)), heads(self.values(rows_b))
        return (self.update(rows_a, attend(keys_a, keys_b, values_b, real_b)),
                self.update(rows_b, attend(keys_b, keys_a, values_a, real_a)))


class Assignment(nn.Module):
    def __init__(self):
        super().__init__()
        self.project, self.has_partner = nn.Linear(WIDTH, WIDTH), nn.Linear(WIDTH, 1)
        nn.init.zeros_(self.project.bias)
        self.project.weight.data = (SHARPNESS / WIDTH) ** 0.5 * torch.eye(WIDTH)
        nn.init.zeros_(self.has_partner.weight)

    def forward(self, rows_a, rows_b, real_a=None, real_b=None):
        """log P [..., N_a, N_b] that two are partners; logits, of each point, that it has one at all."""
        similarity = self.project(rows_a) @ self.project(rows_b).transpose(-2, -1)
        if real_a is not None:
            similarity = similarity.masked_fill(~(real_a[..., None] & real_b[..., None, :]), NEVER)
        has_a, has_b = self.has_partner(rows_a), self.has_partner(rows_b)
        log = (similarity.log_softmax(-1) + similarity.log_softmax(-2) + F.logsigmoid(has_a)
               + F.logsigmoid(has_b).transpose(-2, -1))
        return log, has_a[..., 0], has_b[..., 0]


class Matcher(nn.Module):
    def __init__(self):
        super().__init__()
        self.waves = nn.Linear(2, WIDTH // 2, bias=False)
        nn.init.normal_(self.waves.weight)
        self.within = nn.ModuleList(Within() for _ in range(LAYERS))
        self.across = nn.ModuleList(Across() for _ in range(LAYERS))
        self.assignment = Assignment()

    def turn(self, keypoints):
        phase = heads(self.waves(keypoints), WIDTH // HEADS // 2)
        return phase.cos(), phase.sin()

    def layers(self, keypoints_a, keypoints_b, descriptors_a, descriptors_b, real_a=None, real_b=None):
        """Keypoints [..., N, 2] as the product normalises them, unit descriptors [..., N, WIDTH]; where pairs are
        stacked, which rows are real [..., N] and which fill up. Both pictures' rows after each layer."""
        turn_a, turn_b = self.turn(keypoints_a), self.turn(keypoints_b)
        rows_a, rows_b = WIDTH ** 0.5 * descriptors_a, WIDTH ** 0.5 * descriptors_b
        for within, across in zip(self.within, self.across):
            rows_a, rows_b = across(within(rows_a, turn_a, real_a), within(rows_b, turn_b, real_b), real_a, real_b)
            yield rows_a, rows_b

    def forward(self, *features):
        *_, last = self.layers(*features)
        return self.assignment(*last)[0]


def select(log):
    """Of log P [N_a, N_b], those that are each other's best: index pairs [M, 2], and P."""
    (best, best_b), best_a = log.max(1), log.argmax(0)
    each = torch.arange(log.shape[0], device=log.device)
    index = torch.nonzero(best_a.index_select(0, best_b) == each)[:, 0]
    return torch.stack([index, best_b.index_select(0, index)], 1), best.index_select(0, index).exp()
