#include "protocol/codec/fast_column.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "protocol/codec/raw_column.hpp"

namespace probebox::codec {
namespace {

constexpr unsigned kHasExceptions = 0x80;
constexpr std::size_t kNarrow = 256;
constexpr std::size_t kSurveyed = 64;  // values of a column that its predictor is chosen by

using frame::unzigzag;
using frame::zigzag;
using Seeds = std::array<std::uint64_t, kMostOrder>;

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

// How many groups of `width` bytes lie so far before the end of what may be touched that packing and unpacking do not
// reach beyond it.
std::size_t directGroups(std::size_t bytes, std::size_t width, std::size_t most) {
  if (width == 0) return most;
  return bytes < kSlack ? 0 : std::min(most, (bytes - kSlack) / width);
}

// readable: bytes from there on, of which those behind the column are of other things.
void unpackResiduals(std::span<const std::byte> from, std::size_t readable, std::size_t width,
                     std::span<std::int64_t> into, const Kernels& kernels) {
  const std::size_t direct = directGroups(readable, width, into.size() / kGroup);
  kernels.unpack[width](from.data(), direct, into.data());
  for (std::size_t done = direct * kGroup; done < into.size(); done += kGroup) {
    std::array<std::int64_t, kGroup> values{};
    std::array<std::byte, kGroup * 8 + kSlack> last{};
    const auto rest = from.subspan(done / kGroup * width);
    std::copy_n(rest.begin(), std::min(width, rest.size()), last.begin());
    kernels.unpack[width](last.data(), 1, values.data());
    std::copy_n(values.begin(), std::min(kGroup, into.size() - done), into.begin() + static_cast<std::ptrdiff_t>(done));
  }
}

// pack: packs groups of values from the one of that number on.
template <class Pack>
void packGroups(std::span<std::byte> into, std::size_t room, std::size_t width, std::size_t count, Pack pack) {
  const std::size_t groups = (count + kGroup - 1) / kGroup;
  const std::size_t direct = directGroups(room, width, groups);
  pack(0, direct, into.data());
  std::array<std::byte, kGroup * 8 + kSlack> last{};
  for (std::size_t group = direct; group < groups; ++group) {
    pack(group, 1, last.data());
    const auto rest = into.subspan(group * width);
    std::copy_n(last.begin(), std::min(width, rest.size()), rest.begin());
  }
}

// In sixteenths; all ones where the sum says nothing.
std::uint64_t meanOf(std::uint64_t sum, std::size_t count) {
  return sum == ~std::uint64_t{0} ? sum : 16 * sum / count;
}

}  // namespace

void FastColumnEncoder::plan(std::span<const Column> columns) {
  for (std::size_t k = 0; k < columns.size(); ++k) {
    works_[k].column = columns[k];
    survey(works_[k]);
  }
  track(kTracking, 2, columns.size());
  track(kTracking + 1, kMostOrder, columns.size());
  for (auto& work : std::span{works_}.first(columns.size())) {
    if (work.order < kTracking) subtract(work);
    planOne(work);
  }
}

// The difference that the middle of the column, which stands for all of it, speaks for.
void FastColumnEncoder::survey(Work& work) const {
  const auto& values = work.column.values;
  work.order = 0;
  work.mean = 0;
  if (values.size() <= kMostOrder) return;
  const auto some = std::min(values.size(), kSurveyed);
  const auto sums = kernels_.survey(values.data() + (values.size() - some) / 2, some);
  const auto order = static_cast<std::size_t>(std::ranges::min_element(sums) - sums.begin());
  work.order = static_cast<std::uint8_t>(order);
  work.mean = meanOf(sums[order], some - kMostOrder);
}

// Tries a tracking predictor on the columns that it suits, those that move and are noisy and for which a difference of
// that order or more is the shortest so far, and keeps it where it is shorter.
void FastColumnEncoder::track(std::size_t predictor, std::size_t least_order, std::size_t columns) {
  std::array<Work*, kTracked> works{};
  std::array<const std::int64_t*, kTracked> from{};
  std::array<std::int64_t*, kTracked> into{};
  std::size_t some = 0;
  for (auto& work : std::span{works_}.first(columns)) {
    if (work.order < least_order || work.order >= kTracking || work.mean == 0) continue;
    works[some] = &work;
    from[some] = work.column.values.data() + kMostOrder;
    into[some++] = work.residuals.data();
  }
  if (some == 0) return;
  const auto count = works[0]->column.values.size() - kMostOrder;
  kernels_.track[predictor - kTracking][some - 1](from.data(), count, into.data());
  for (auto* work : std::span{works}.first(some)) {
    judge(*work, count);
    if (meanOf(work->size.sum, count) < work->mean) work->order = static_cast<std::uint8_t>(predictor);
  }
}

void FastColumnEncoder::subtract(Work& work) const {
  const auto values = work.column.values.subspan(work.order);
  kernels_.residuals[work.order](values.data(), values.size(), work.residuals.data());
  judge(work, values.size());
}

void FastColumnEncoder::judge(Work& work, std::size_t count) const {
  std::fill_n(work.residuals.begin() + static_cast<std::ptrdiff_t>(count), (kStride - count % kStride) % kStride, 0);
  work.size = kernels_.size(work.residuals.data(), count, work.narrow.data());
}

void FastColumnEncoder::planOne(Work& work) const {
  const auto& [format, values] = work.column;
  work.plan = {.width = static_cast<std::uint8_t>(8 * format.bytes), .bytes = values.size() * format.bytes};
  const std::size_t seeds = seedsOf(work.order);
  const auto differences = differencesOf(values, seeds);
  work.seeds_bytes = 0;
  for (std::size_t k = 0; k < seeds; ++k) work.seeds_bytes += varintSize(zigzag(differences[k]));
  chooseWidth(work, values.size() - seeds);
}

// The costs of widths have one valley for all that occurs; it is looked for from where a normal distribution has it, up
// and then, where outliers have raised the mean, down.
void FastColumnEncoder::chooseWidth(Work& work, std::size_t count) const {
  const unsigned most_bits = work.size.most_bits;
  consider(work, count, most_bits, 0);
  const std::uint64_t mean = meanOf(work.size.sum, count);
  const auto usual = mean == ~std::uint64_t{0} ? 0U : static_cast<unsigned>(std::bit_width(mean / 8));
  for (unsigned width = usual; width < most_bits; width += 4) {
    if (!considerFrom(work, count, width) && width > usual) break;
  }
  if (most_bits < usual + 3) return;
  for (unsigned width = usual; width > 0;) {
    width = width < 4 ? 0 : width - 4;
    if (!considerFrom(work, count, width)) return;
  }
}

// Four widths; whether one of them is the best so far.
bool FastColumnEncoder::considerFrom(Work& work, std::size_t count, unsigned width) const {
  const auto before = work.plan.bytes;
  const auto wider = work.isNarrow() ? kernels_.narrow_wider(work.narrow.data(), count, width)
                                     : kernels_.wider(work.residuals.data(), count, width);
  for (unsigned k = 0; k < wider.size() && width + k < work.size.most_bits; ++k)
    consider(work, count, width + k, wider[k]);
  return work.plan.bytes < before;
}

void FastColumnEncoder::consider(Work& work, std::size_t count, unsigned width, std::size_t exceptions) {
  const std::size_t unit = count <= kNarrow ? 1 : 2;
  if (exceptions > (unit == 1 ? 0xFFU : 0xFFFFU)) return;
  const unsigned high_bits = work.size.most_bits - width;
  const std::size_t extra = exceptions == 0 ? 0 : unit + 1 + exceptions * unit + packedSize(exceptions, high_bits);
  const std::size_t bytes = work.seeds_bytes + packedSize(count, width) + extra;
  if (bytes >= work.plan.bytes) return;
  work.plan = {work.order, static_cast<std::uint8_t>(width), static_cast<std::uint32_t>(exceptions),
               static_cast<std::uint8_t>(high_bits), bytes};
}

void FastColumnEncoder::put(frame::ByteWriter& writer, std::size_t column) {
  const auto& work = works_[column];
  const auto& [format, values] = work.column;
  if (work.plan.isRaw(format)) {
    putRaw(writer, format, values);
    return;
  }
  const std::size_t seeds = seedsOf(work.plan.order);
  const std::size_t count = values.size() - seeds;
  const auto differences = differencesOf(values, seeds);
  for (std::size_t k = 0; k < seeds; ++k) frame::putVarint(writer, zigzag(differences[k]));
  const std::size_t room = writer.room();
  pack(work, writer.take(packedSize(count, work.plan.width)), room, count);
  if (work.plan.exceptions > 0) putExceptions(work, writer, count);
}

void FastColumnEncoder::putExceptions(const Work& work, frame::ByteWriter& writer, std::size_t count) {
  const auto& plan = work.plan;
  putPlace(writer, count, plan.exceptions);
  writer.put(plan.high_bits);
  if (work.isNarrow()) {
    kernels_.narrow_places(work.narrow.data(), count, plan.width, places_.data());
  } else {
    kernels_.places(work.residuals.data(), count, plan.width, places_.data());
  }
  const auto places = std::span{places_}.first(plan.exceptions);
  frame::ByteWriter coded_places{writer.take(plan.exceptions * (count <= kNarrow ? 1U : 2U))};
  for (const auto place : places) putPlace(coded_places, count, place);
  std::fill_n(highs_.begin(), (places.size() + kGroup - 1) / kGroup * kGroup, 0);
  std::ranges::transform(places, highs_.begin(), [&](auto place) { return work.residuals[place] >> plan.width; });
  const std::size_t room = writer.room();
  packGroups(writer.take(packedSize(places.size(), plan.high_bits)), room, plan.high_bits, places.size(),
             [&](std::size_t from, std::size_t how_many, std::byte* at) {
               kernels_.pack[plan.high_bits](highs_.data() + from * kGroup, how_many, at);
             });
}

// room: bytes from there on; those behind the column may be touched, and are written later.
void FastColumnEncoder::pack(const Work& work, std::span<std::byte> into, std::size_t room, std::size_t count) const {
  const std::size_t width = work.plan.width;
  packGroups(into, room, width, count, [&](std::size_t from, std::size_t how_many, std::byte* at) {
    if (work.isNarrow() && width <= kNarrowPacked) {
      kernels_.narrow_pack[width](work.narrow.data() + from * kGroup, how_many, at);
    } else {
      kernels_.pack[width](work.residuals.data() + from * kGroup, how_many, at);
    }
  });
}

void FastColumnDecoder::get(frame::ByteReader& reader, std::size_t channel, ChannelFormat format, std::uint8_t order,
                            std::uint8_t width, std::span<std::int64_t> column) {
  const Held held{channel, format, column};
  if (order == 0 && width == 8 * format.bytes) {
    const auto bytes = column.size() * format.bytes;
    if (reader.remaining() < bytes) reader.fail();
    if (!reader.failed() && !getRaw(reader, format, column)) bad_ = channel;
    return;
  }
  if (!read(reader, held, order, width)) {
    bad_ = channel;
    return;
  }
  const std::size_t predictor = order & 0x7FU;
  if (predictor >= kTracking) {
    auto& [columns, some] = waiting_[predictor - kTracking];
    columns[some++] = held;
    if (some == columns.size()) finish(predictor - kTracking);
    return;
  }
  kernels_.integrate[predictor](column.data() + predictor, column.size() - predictor);
  check(held);
}

void FastColumnDecoder::finish(std::size_t tracking) {
  auto& [waiting, some] = waiting_[tracking];
  if (some == 0) return;
  std::array<std::int64_t*, kUntracked> columns{};
  for (std::size_t k = 0; k < some; ++k) columns[k] = waiting[k].column.data() + kMostOrder;
  kernels_.untrack[tracking][some - 1](columns.data(), waiting[0].column.size() - kMostOrder);
  for (const auto& held : std::span{waiting}.first(some)) check(held);
  some = 0;
}

void FastColumnDecoder::check(const Held& held) {
  if (firstMisfit(held.format, held.column, kernels_) != held.column.size() && !bad_) bad_ = held.channel;
}

// Seeds and residuals.
bool FastColumnDecoder::read(frame::ByteReader& reader, const Held& held, std::uint8_t order, std::uint8_t width) {
  const auto& column = held.column;
  const std::size_t predictor = order & 0x7FU;
  const std::size_t seeds = seedsOf(predictor);
  if (predictor >= kTracking + kTrackings || width > 64 || (seeds > 0 && seeds >= column.size())) return false;
  Seeds differences{};
  for (std::size_t k = 0; k < seeds; ++k) differences[k] = unzigzag(frame::getVarint(reader));
  const std::size_t readable = reader.remaining();
  const auto packed = reader.take(packedSize(column.size() - seeds, width));
  if (reader.failed()) return false;
  restore(differences, seeds);
  for (std::size_t k = 0; k < seeds; ++k) column[k] = static_cast<std::int64_t>(differences[k]);
  const auto residuals = column.subspan(seeds);
  unpackResiduals(packed, readable, width, residuals, kernels_);
  return (order & kHasExceptions) == 0 || getExceptions(reader, width, residuals);
}

// False when a position is none of the column's.
bool FastColumnDecoder::getExceptions(frame::ByteReader& reader, unsigned width, std::span<std::int64_t> residuals) {
  const std::size_t count = getPlace(reader, residuals.size());
  const unsigned high_bits = reader.get<std::uint8_t>();
  if (reader.failed() || count > residuals.size() || high_bits < 1 || width + high_bits > 64) return false;
  const bool narrow = residuals.size() <= kNarrow;
  const auto places = reader.take(count * (narrow ? 1 : 2));
  const std::size_t readable = reader.remaining();
  const auto packed = reader.take(packedSize(count, high_bits));
  if (reader.failed()) return false;
  const auto highs = std::span{highs_}.first(count);
  unpackResiduals(packed, readable, high_bits, highs, kernels_);
  const auto mask = (std::uint64_t{1} << width) - 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t place =
        narrow ? std::to_integer<std::size_t>(places[k]) : frame::loadLittle<std::uint16_t>(&places[2 * k]);
    if (place >= residuals.size()) return false;
    const auto low = static_cast<std::uint64_t>(residuals[place]) & mask;
    residuals[place] = static_cast<std::int64_t>((static_cast<std::uint64_t>(highs[k]) << width) | low);
  }
  return true;
}

}  // namespace probebox::codec
