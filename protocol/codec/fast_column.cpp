#include "protocol/codec/fast_column.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "protocol/codec/raw_column.hpp"

namespace probebox::codec {
namespace {

constexpr unsigned kHasExceptions = 0x80;
constexpr std::size_t kNarrow = 256;
constexpr std::size_t kSurveyed = 96;  // values of a column that its predictor is chosen by

using Seeds = std::array<std::uint64_t, kMostOrder>;

std::uint64_t zigzag(std::uint64_t value) {
  return (value << 1U) ^ (0 - (value >> 63U));
}
std::uint64_t unzigzag(std::uint64_t coded) {
  return (coded >> 1U) ^ (0 - (coded & 1U));
}

// The first values as differences of rising order, and back.
Seeds differencesOf(std::span<const std::int64_t> column, std::size_t order) {
  Seeds seeds{};
  for (std::size_t k = 0; k < order; ++k) seeds[k] = static_cast<std::uint64_t>(column[k]);
  for (std::size_t pass = 1; pass < order; ++pass) {
    for (std::size_t k = order - 1; k >= pass; --k) seeds[k] -= seeds[k - 1];
  }
  return seeds;
}
void restore(Seeds& seeds, std::size_t order) {
  for (std::size_t pass = order; pass-- > 1;) {
    for (std::size_t k = pass; k < order; ++k) seeds[k] += seeds[k - 1];
  }
}

std::size_t varintSize(std::uint64_t value) {
  return (static_cast<std::size_t>(std::bit_width(value | 1U)) + 6) / 7;
}
void putVarint(frame::ByteWriter& writer, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7U) writer.put(static_cast<std::uint8_t>(value | 0x80U));
  writer.put(static_cast<std::uint8_t>(value));
}
std::uint64_t getVarint(frame::ByteReader& reader) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const std::uint64_t byte = reader.get<std::uint8_t>();
    value |= (byte & 0x7FU) << shift;
    if ((byte & 0x80U) == 0) break;
  }
  return value;
}

// Numbers and positions of exceptions.
void putPlace(frame::ByteWriter& writer, std::size_t residuals, std::size_t place) {
  if (residuals <= kNarrow) {
    writer.put(static_cast<std::uint8_t>(place));
  } else {
    writer.put(static_cast<std::uint16_t>(place));
  }
}
std::size_t getPlace(frame::ByteReader& reader, std::size_t residuals) {
  return residuals <= kNarrow ? reader.get<std::uint8_t>() : reader.get<std::uint16_t>();
}

std::size_t packedSize(std::size_t residuals, std::size_t width) {
  return (residuals * width + 7) / 8;
}

// How many groups of `width` bytes lie so far before the end that touching some bytes behind them does no harm.
std::size_t directGroups(std::size_t bytes, std::size_t width, std::size_t most) {
  if (width == 0) return most;
  return bytes < kSlack ? 0 : std::min(most, (bytes - kSlack) / width);
}

void unpackResiduals(std::span<const std::byte> from, std::size_t width, std::span<std::int64_t> into,
                     const Kernels& kernels) {
  const std::size_t direct = directGroups(from.size(), width, into.size() / kGroup);
  kernels.unpack[width](from.data(), direct, into.data());
  std::array<std::int64_t, kGroup> values{};
  std::array<std::byte, kGroup * 8 + kSlack> last{};
  for (std::size_t done = direct * kGroup; done < into.size(); done += kGroup) {
    const auto rest = from.subspan(done / kGroup * width);
    std::copy_n(rest.begin(), std::min(width, rest.size()), last.begin());
    kernels.unpack[width](last.data(), 1, values.data());
    std::copy_n(values.begin(), std::min(kGroup, into.size() - done), into.begin() + static_cast<std::ptrdiff_t>(done));
  }
}

// High parts are little endian, of 1 to 8 bytes.
void storeHigh(std::uint64_t high, std::span<std::byte> into) {
  for (auto& byte : into) {
    byte = static_cast<std::byte>(high);
    high >>= 8U;
  }
}
std::uint64_t loadHigh(std::span<const std::byte> from) {
  std::uint64_t high = (from.back() & std::byte{0x80}) != std::byte{0} ? ~std::uint64_t{0} : 0;
  for (std::size_t k = from.size(); k-- > 0;) high = (high << 8U) | std::to_integer<std::uint64_t>(from[k]);
  return high;
}

// False when a position is none of the column's.
bool getExceptions(frame::ByteReader& reader, unsigned width, std::span<std::int64_t> residuals) {
  const std::size_t count = getPlace(reader, residuals.size());
  const std::size_t high_bytes = reader.get<std::uint8_t>();
  if (reader.failed()) return false;
  if (high_bytes < 1 || high_bytes > 8 || width > 63) return false;
  frame::ByteReader places{reader.take(count * (residuals.size() <= kNarrow ? 1 : 2))};
  const auto highs = reader.take(count * high_bytes);
  if (reader.failed()) return false;
  for (std::size_t k = 0; k < count; ++k) {
    const auto place = getPlace(places, residuals.size());
    if (place >= residuals.size()) return false;
    const auto low = static_cast<std::uint64_t>(residuals[place]) & ((std::uint64_t{1} << width) - 1);
    const auto high = loadHigh(highs.subspan(k * high_bytes, high_bytes));
    residuals[place] = static_cast<std::int64_t>((high << width) | low);
  }
  return true;
}

// In sixteenths; all ones where the sum says nothing.
std::uint64_t meanOf(std::uint64_t sum, std::size_t count) {
  return sum == ~std::uint64_t{0} ? sum : 16 * sum / count;
}

}  // namespace

const FastPlan& FastColumnEncoder::plan(ChannelFormat format, std::span<const std::int64_t> column) {
  plan_ = {.width = static_cast<std::uint8_t>(8 * format.bytes), .bytes = column.size() * format.bytes};
  order_ = choosePredictor(column);
  const std::size_t seeds = seedsOf(order_);
  const auto differences = differencesOf(column, seeds);
  seeds_bytes_ = 0;
  for (std::size_t k = 0; k < seeds; ++k) seeds_bytes_ += varintSize(zigzag(differences[k]));
  const std::size_t count = column.size() - seeds;
  chooseWidth(count);
  std::fill_n(residuals_ + count, (kGroup - count % kGroup) % kGroup, 0);
  return plan_;
}

// And works out its residuals. The middle of the column stands for all of it.
std::uint8_t FastColumnEncoder::choosePredictor(std::span<const std::int64_t> column) {
  std::size_t order = 0;
  std::uint64_t mean = 0;
  if (column.size() > kMostOrder) {
    const auto some = std::min(column.size(), kSurveyed);
    const auto sums = kernels_.survey(column.data() + (column.size() - some) / 2, some);
    order = static_cast<std::size_t>(std::ranges::min_element(sums) - sums.begin());
    mean = meanOf(sums[order], some - kMostOrder);
  }
  // Tracking is for what moves, and noisily.
  if (order >= 2 && mean > 0) {
    const auto count = column.size() - kMostOrder;
    kernels_.residuals[kTracking](column.data() + kMostOrder, count, tracked_.data());
    size_ = kernels_.size(tracked_.data(), count);
    residuals_ = tracked_.data();
    if (meanOf(size_.sum, count) < mean) return kTracking;
  }
  kernels_.residuals[order](column.data() + order, column.size() - order, different_.data());
  size_ = kernels_.size(different_.data(), column.size() - order);
  residuals_ = different_.data();
  return static_cast<std::uint8_t>(order);
}

// The costs of widths have one valley for all that occurs; it is looked for from where a normal distribution has it, up
// and then, where outliers have raised the mean, down.
void FastColumnEncoder::chooseWidth(std::size_t count) {
  consider(count, size_.most_bits, 0);
  const std::uint64_t mean = meanOf(size_.sum, count);
  const auto usual = mean == ~std::uint64_t{0} ? 0U : static_cast<unsigned>(std::bit_width(mean / 8));
  for (unsigned width = usual; width < size_.most_bits; width += 4) {
    if (!considerFrom(count, width) && width > usual) break;
  }
  if (size_.most_bits < usual + 3) return;
  for (unsigned width = usual; width > 0;) {
    width = width < 4 ? 0 : width - 4;
    if (!considerFrom(count, width)) return;
  }
}

// Four widths; whether one of them is the best so far.
bool FastColumnEncoder::considerFrom(std::size_t count, unsigned width) {
  const auto before = plan_.bytes;
  const auto wider = kernels_.wider(residuals_, count, width);
  for (unsigned k = 0; k < wider.size() && width + k < size_.most_bits; ++k) consider(count, width + k, wider[k]);
  return plan_.bytes < before;
}

void FastColumnEncoder::consider(std::size_t count, unsigned width, std::size_t exceptions) {
  const std::size_t unit = count <= kNarrow ? 1 : 2;
  if (exceptions > (unit == 1 ? 0xFFU : 0xFFFFU)) return;
  const std::size_t high_bytes = (size_.most_bits - width + 7) / 8;
  const std::size_t extra = exceptions == 0 ? 0 : unit + 1 + exceptions * (unit + high_bytes);
  const std::size_t bytes = seeds_bytes_ + packedSize(count, width) + extra;
  if (bytes >= plan_.bytes) return;
  plan_ = {order_, static_cast<std::uint8_t>(width), static_cast<std::uint32_t>(exceptions),
           static_cast<std::uint8_t>(high_bytes), bytes};
}

void FastColumnEncoder::put(frame::ByteWriter& writer, ChannelFormat format, std::span<const std::int64_t> column) {
  if (plan_.isRaw(format)) {
    putRaw(writer, format, column);
    return;
  }
  const std::size_t seeds = seedsOf(plan_.order);
  const std::size_t count = column.size() - seeds;
  const auto differences = differencesOf(column, seeds);
  for (std::size_t k = 0; k < seeds; ++k) putVarint(writer, zigzag(differences[k]));
  pack(writer.take(packedSize(count, plan_.width)), count);
  if (plan_.exceptions == 0) return;
  const std::size_t unit = count <= kNarrow ? 1 : 2;
  putPlace(writer, count, plan_.exceptions);
  writer.put(plan_.high_bytes);
  frame::ByteWriter places{writer.take(plan_.exceptions * unit)};
  auto highs = writer.take(plan_.exceptions * plan_.high_bytes);
  kernels_.places(residuals_, count, plan_.width, places_.data());
  for (const auto place : std::span{places_}.first(plan_.exceptions)) {
    putPlace(places, count, place);
    storeHigh(static_cast<std::uint64_t>(static_cast<std::int64_t>(residuals_[place]) >> plan_.width),
              highs.first(plan_.high_bytes));
    highs = highs.subspan(plan_.high_bytes);
  }
}

// All but the last bytes go where they belong; packing touches some bytes behind them.
void FastColumnEncoder::pack(std::span<std::byte> into, std::size_t count) const {
  const std::size_t width = plan_.width;
  const std::size_t groups = (count + kGroup - 1) / kGroup;
  const std::size_t direct = directGroups(into.size(), width, groups);
  kernels_.pack[width](residuals_, direct, into.data());
  std::array<std::byte, kGroup * 8 + kSlack> last{};
  for (std::size_t group = direct; group < groups; ++group) {
    kernels_.pack[width](residuals_ + group * kGroup, 1, last.data());
    const auto rest = into.subspan(group * width);
    std::copy_n(last.begin(), std::min(width, rest.size()), rest.begin());
  }
}

bool getFast(frame::ByteReader& reader, ChannelFormat format, std::uint8_t order, std::uint8_t width,
             std::span<std::int64_t> column, const Kernels& kernels) {
  if (order == 0 && width == 8 * format.bytes) {
    const auto bytes = column.size() * format.bytes;
    if (reader.remaining() < bytes) reader.fail();
    return !reader.failed() && getRaw(reader, format, column);
  }
  const bool has_exceptions = (order & kHasExceptions) != 0;
  const std::size_t predictor = order & 0x7FU;
  const std::size_t seeds = seedsOf(predictor);
  if (predictor > kTracking || width > 64 || (seeds > 0 && seeds >= column.size())) return false;
  Seeds differences{};
  for (std::size_t k = 0; k < seeds; ++k) differences[k] = unzigzag(getVarint(reader));
  const auto packed = reader.take(packedSize(column.size() - seeds, width));
  if (reader.failed()) return false;
  restore(differences, seeds);
  for (std::size_t k = 0; k < seeds; ++k) column[k] = static_cast<std::int64_t>(differences[k]);
  const auto residuals = column.subspan(seeds);
  unpackResiduals(packed, width, residuals, kernels);
  if (has_exceptions && !getExceptions(reader, width, residuals)) return false;
  kernels.integrate[predictor](residuals.data(), residuals.size());
  return firstMisfit(format, column, kernels) == column.size();
}

}  // namespace probebox::codec
