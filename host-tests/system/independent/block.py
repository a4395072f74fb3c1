"""Blocks of samples as protocol/MESSAGES.md says, profiles raw and fast."""
from frames import Cursor

ALL = 2**64 - 1


def signed(value, bits=64):
    value &= (1 << bits) - 1
    return value - (1 << bits) if bits and value >> (bits - 1) else value


class Block:
    def __init__(self, payload, channels):
        c = Cursor(payload)
        self.profile = c.take("B")
        self.first, self.count, self.samples_per_tick = c.take("q"), c.take("H"), c.take("H")
        self.tick, self.at, self.period_q32_ns = c.take("q"), c.take("q"), c.take("q")
        self.sigma_ns, self.state, self.holdover_ms = c.take("I"), c.take("B"), c.take("I")
        if c.take("B") != len(channels):
            raise ValueError("coded for other channels")
        self.codings = [(c.take("B"), c.take("B")) for _ in channels]
        self.columns = [_column(c, channel, *coding, self.count) for channel, coding in zip(channels, self.codings)]
        if c.at != len(payload):
            raise ValueError("bytes behind the last column")

    def time_ns(self, k):
        ticks_q32 = (self.first + k - self.tick * self.samples_per_tick) * self.period_q32_ns
        return self.at + (ticks_q32 // self.samples_per_tick >> 32)


def _column(c, channel, order, width, count):
    if order == 0 and width == 8 * channel.bytes:
        return [
            int.from_bytes(c.bytes(channel.bytes), "little", signed=bool(channel.is_signed)) for _ in range(count)
        ]
    predictor = order & 0x7F
    seeds = _seeds(c, min(predictor, 3))
    residuals = _residuals(c, width, count - len(seeds))
    if order & 0x80:
        _exceptions(c, width, residuals)
    return _values(predictor, seeds, residuals)


def _seeds(c, how_many):
    """The first values themselves, from their differences of rising order."""
    differences = []
    for _ in range(how_many):
        coded = c.varint() & ALL
        differences.append(-(coded + 1 >> 1) if coded & 1 else coded >> 1)
    weights = [[1], [1, 1], [1, 2, 1]]
    return [signed(sum(w * d for w, d in zip(weights[k], differences))) for k in range(how_many)]


def _residuals(c, width, how_many):
    bits = int.from_bytes(c.bytes((how_many * width + 7) // 8), "little")
    return [signed(bits >> (k * width), width) for k in range(how_many)] if width else [0] * how_many


def _exceptions(c, width, residuals):
    unit = "B" if len(residuals) <= 256 else "H"
    how_many, bits = c.take(unit), c.take("B")
    places = [c.take(unit) for _ in range(how_many)]
    for place, high in zip(places, _residuals(c, bits, how_many)):
        residuals[place] = signed((high << width) + (residuals[place] & ((1 << width) - 1)))


def _values(predictor, seeds, residuals):
    x = list(seeds)
    if predictor >= 4:
        first, others = {4: ((16, 8, 8, 0), (12, 5, 1, 0)), 5: ((12, 16, 10, 3), (12, 7, 2, 1))}[predictor]
        j = 0
        a = 16 * (x[2] - 2 * x[1] + x[0])
        v = 16 * (x[2] - x[1]) + a
        p = 16 * x[2] + v + 8
        for k, r in enumerate(residuals):
            x.append(signed((signed(p) >> 4) + r))
            of_place, of_speed, of_acceleration, of_jerk = others if k else first
            j += of_jerk * r
            a += j + of_acceleration * r
            v += a + of_speed * r
            p += v + of_place * r
        return x
    for r in residuals:
        if predictor == 1:
            r += x[-1]
        elif predictor == 2:
            r += 2 * x[-1] - x[-2]
        elif predictor == 3:
            r += 3 * x[-1] - 3 * x[-2] + x[-3]
        x.append(signed(r))
    return x
