#include "protocol/codec/tight.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "protocol/codec/kernels.hpp"
#include "protocol/codec/raw_column.hpp"
#include "protocol/frame/changes.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::codec {
namespace {

// Residuals are normal, with one in fifty three times as wide: their cumulative distribution at steps of a 32nd of a
// standard deviation, in parts of 2^24, from -8 to 8.
constexpr int kPerSd = 32;
constexpr int kReach = 8;
constexpr std::size_t kSteps = 2 * kReach * kPerSd;
constexpr std::int64_t kSymbols = 160;  // on each side of what is expected; what lies beyond is an outlier
constexpr double kShared = (1U << Interval::kProbabilityBits) - 2 * kSymbols - 2;  // each symbol has one part more

constexpr std::array<double, kSteps + 1> normalDensity(double step) {
  std::array<double, kSteps + 1> density{};
  // exp(-x^2 / 2) at x = k step from that at k - 1; the series of the exponential suffices for a small exponent.
  const auto exponential = [](double x) { return 1 + x * (1 + x / 2 * (1 + x / 3 * (1 + x / 4 * (1 + x / 5)))); };
  const double ratio_of_ratios = exponential(-step * step);
  double ratio = exponential(-step * step / 2);
  double value = 1;
  for (std::size_t k = 0; k <= kSteps / 2; ++k) {
    density[kSteps / 2 + k] = density[kSteps / 2 - k] = value;
    value *= ratio;
    ratio *= ratio_of_ratios;
  }
  return density;
}

constexpr auto kCumulative = [] {
  constexpr double kWide = 3;
  constexpr double kShareOfWide = 0.02;
  constexpr double kDensityOfNormal = 0.3989422804014327;
  const auto usual = normalDensity(1.0 / kPerSd);
  const auto wide = normalDensity(1.0 / (kPerSd * kWide));
  const auto density = [&](std::size_t k) {
    return kDensityOfNormal * ((1 - kShareOfWide) * usual[k] + kShareOfWide / kWide * wide[k]);
  };
  std::array<std::int32_t, kSteps + 1> table{};
  double inside = 0;
  for (std::size_t k = 0; k < kSteps; ++k) inside += (density(k) + density(k + 1)) / 2 / kPerSd;
  double sum = (1 - inside) / 2;
  for (std::size_t k = 0; k <= kSteps; ++k) {
    table[k] = static_cast<std::int32_t>(kShared * sum);
    if (k < kSteps) sum += (density(k) + density(k + 1)) / 2 / kPerSd;
  }
  return table;
}();

// How a residual is coded: its bits above the lowest `shift` ones as a symbol, those as they are.
class Residuals {
 public:
  explicit Residuals(const TightPredictor::Expected& expected)
      : shift_{expected.sd < 16
                   ? 0U
                   : static_cast<unsigned>(std::bit_width(static_cast<std::uint64_t>(expected.sd / 8)) - 1)},
        per_symbol_{static_cast<double>(std::uint64_t{1} << shift_) / expected.sd * kPerSd},
        at_zero_{kReach * kPerSd - (0.5 + expected.fraction) / expected.sd * kPerSd} {}

  unsigned shift() const { return shift_; }
  // Where the symbol's part begins, and the one's after it ends; rises by at least 1 a symbol.
  std::uint64_t from(std::int64_t symbol) const {
    const double place = std::clamp(at_zero_ + static_cast<double>(symbol) * per_symbol_, 0.0, double{kSteps});
    const auto step = std::min(static_cast<std::size_t>(place), kSteps - 1);
    const double low = kCumulative[step];
    const double high = kCumulative[step + 1];
    const double below = low + (high - low) * (place - static_cast<double>(step));
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(below) + symbol + kSymbols + 1);
  }

 private:
  unsigned shift_;
  double per_symbol_;
  double at_zero_;
};

constexpr std::uint64_t kWhole = std::uint64_t{1} << Interval::kProbabilityBits;

// A number of any size: how many bits, then those behind the first one.
void putNumber(RangeEncoder& coder, std::uint64_t number) {
  const auto bits = static_cast<unsigned>(std::bit_width(number));
  coder.put(bits, 1, 7);
  if (bits > 1) coder.putBits(number, bits - 1);
}
std::uint64_t getNumber(RangeDecoder& coder) {
  const auto bits = static_cast<unsigned>(coder.next(7));
  coder.take(bits, 1, 7);
  if (bits < 2 || bits > 64) return bits;
  return std::uint64_t{1} << (bits - 1) | coder.getBits(bits - 1);
}

void put(RangeEncoder& coder, TightPredictor& predictor, std::int64_t value) {
  const auto expected = predictor.expected();
  const auto residual = static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(expected.whole);
  if (!expected.has_sd) {
    putNumber(coder, frame::zigzag(residual));
    return predictor.learn(value);
  }
  const Residuals residuals{expected};
  const auto symbol = static_cast<std::int64_t>(residual) >> residuals.shift();
  const auto lowest = residuals.from(-kSymbols);
  const auto highest = residuals.from(kSymbols);
  if (symbol < -kSymbols) {
    coder.put(0, lowest);
    putNumber(coder, static_cast<std::uint64_t>(-kSymbols - 1 - symbol));
  } else if (symbol >= kSymbols) {
    coder.put(highest, kWhole - highest);
    putNumber(coder, static_cast<std::uint64_t>(symbol - kSymbols));
  } else {
    const auto from = residuals.from(symbol);
    coder.put(from, residuals.from(symbol + 1) - from);
  }
  coder.putBits(residual, residuals.shift());
  predictor.learn(value);
}

std::int64_t get(RangeDecoder& coder, TightPredictor& predictor) {
  const auto expected = predictor.expected();
  const auto valueOf = [&](std::uint64_t residual) {
    const auto value = static_cast<std::int64_t>(static_cast<std::uint64_t>(expected.whole) + residual);
    predictor.learn(value);
    return value;
  };
  if (!expected.has_sd) return valueOf(frame::unzigzag(getNumber(coder)));
  const Residuals residuals{expected};
  const auto part = coder.next();
  const auto lowest = residuals.from(-kSymbols);
  const auto highest = residuals.from(kSymbols);
  std::uint64_t symbol = 0;
  if (part < lowest) {
    coder.take(0, lowest);
    symbol = static_cast<std::uint64_t>(-kSymbols - 1) - getNumber(coder);
  } else if (part >= highest) {
    coder.take(highest, kWhole - highest);
    symbol = static_cast<std::uint64_t>(kSymbols) + getNumber(coder);
  } else {
    std::int64_t low = -kSymbols;
    for (std::int64_t high = kSymbols; high - low > 1;) {
      const auto middle = low + (high - low) / 2;
      (residuals.from(middle) <= part ? low : high) = middle;
    }
    const auto from = residuals.from(low);
    coder.take(from, residuals.from(low + 1) - from);
    symbol = static_cast<std::uint64_t>(low);
  }
  const auto lower_bits = coder.getBits(residuals.shift());
  return valueOf(symbol << residuals.shift() | lower_bits);
}

// The header that a block after this one is expected to have, but for its time.
BlockHeader after(BlockHeader header) {
  // Unsigned: a block of somebody else may state any index.
  const auto on = [](std::int64_t index, std::uint64_t by) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(index) + by);
  };
  header.first = {on(header.first.index, header.count)};
  header.map.tick = {on(header.map.tick.index, header.count / std::max<std::uint64_t>(header.samples_per_tick, 1))};
  return header;
}

CodecError failure(Fault fault, std::size_t channel = 0, std::size_t sample = 0) {
  return {fault, static_cast<std::uint16_t>(channel), static_cast<std::uint16_t>(sample)};
}

}  // namespace

TightEncoder::TightEncoder(std::span<const ChannelFormat> formats) : formats_{formats.begin(), formats.end()} {
  state_.predictors.reserve(formats.size());
}

Outcome<std::size_t, CodecError> TightEncoder::encode(const BlockHeader& header, std::span<const std::int64_t> columns,
                                                      std::span<std::byte> into) {
  const std::size_t count = header.count;
  const bool is_key = !state_.begun || since_key_ + count > kKeyEvery;
  state_.begun = false;  // until it is known that the block will be there
  if (formats_.empty() || count == 0 || columns.size() != formats_.size() * count) return failure(Fault::bad_format);
  const auto raw_size = rawBlockSize(formats_, count);
  const auto most = std::min(raw_size, into.size());
  for (std::size_t channel = 0; channel < formats_.size(); ++channel) {
    const auto done = firstMisfit(formats_[channel], columns.subspan(channel * count, count), kernels());
    if (done != count) return failure(Fault::value_does_not_fit, channel, done);
  }
  frame::ByteWriter writer{into};
  if (is_key) {
    state_.predictors.assign(formats_.size(), {});
    since_key_ = 0;
    putSummary(writer, {Profile::tight, header, formats_.size()});
    for (const auto& format : formats_) {
      writer.put(std::uint8_t{0});
      writer.put(static_cast<std::uint8_t>(8 * format.bytes));
    }
  } else {
    auto shifted = header;
    shiftTime(shifted, state_.header, -1);
    writer.put(Profile::tight_continued);
    writer.put(state_.crc);
    frame::putChanges(writer, after(state_.header), shifted);
  }
  const auto head = std::min(writer.size(), most);
  RangeEncoder coder{into.first(most).subspan(head)};
  for (std::size_t channel = 0; channel < formats_.size(); ++channel) {
    for (const auto value : columns.subspan(channel * count, count)) put(coder, state_.predictors[channel], value);
  }
  const auto size = writer.size() + coder.finish();
  if (size > most) return encodeRaw(header, formats_, columns, into);  // a key block follows
  state_.crc = frame::crc32c(into.first(size));
  state_.header = header;
  state_.begun = true;
  since_key_ += count;
  return size;
}

// Leaves the reader of the block behind the head.
Outcome<BlockSummary, CodecError> Decoder::readHead(std::span<const std::byte> block, frame::ByteReader& reader) const {
  if (reader.get<Profile>() != Profile::tight_continued) {
    const auto summary = codec::inspect(block);
    reader = frame::ByteReader{block};
    if (summary) reader.take(headSize(summary->channels));
    return summary;
  }
  const auto crc = reader.get<std::uint32_t>();
  if (!reader.failed() && (!state_.begun || crc != state_.crc)) return failure(Fault::no_key);
  BlockSummary summary{Profile::tight_continued, frame::withChanges(after(state_.header), reader),
                       state_.predictors.size()};
  if (reader.failed()) return failure(Fault::truncated);
  shiftTime(summary.header, state_.header, 1);
  return summary;
}

Outcome<BlockSummary, CodecError> Decoder::inspect(std::span<const std::byte> block) const {
  frame::ByteReader reader{block};
  return readHead(block, reader);
}

Outcome<BlockSummary, CodecError> Decoder::decode(std::span<const std::byte> block,
                                                  std::span<const ChannelFormat> formats,
                                                  std::span<std::int64_t> columns) {
  frame::ByteReader reader{block};
  const auto summary = readHead(block, reader);
  if (!summary) return summary;
  const bool is_key = summary->profile == Profile::tight;
  if (!is_key && summary->profile != Profile::tight_continued) return codec::decode(block, formats, columns);
  state_.begun = false;
  const std::size_t count = summary->header.count;
  if (count == 0) return failure(Fault::bad_format);
  if (summary->channels != formats.size()) return failure(Fault::other_channels);
  if (columns.size() < formats.size() * count) return failure(Fault::no_room);
  if (is_key) state_.predictors.assign(formats.size(), {});
  if (reader.failed()) return failure(Fault::truncated);
  RangeDecoder coder{reader.take(reader.remaining())};
  for (std::size_t channel = 0; channel < formats.size(); ++channel) {
    const auto column = columns.subspan(channel * count, count);
    for (auto& value : column) value = get(coder, state_.predictors[channel]);
    if (firstMisfit(formats[channel], column, kernels()) != count) return failure(Fault::bad_column, channel);
  }
  state_.begun = coder.ended();
  if (!state_.begun) return failure(Fault::bad_column, formats.size() - 1);
  state_.crc = frame::crc32c(block);
  state_.header = summary->header;
  return summary;
}

}  // namespace probebox::codec
