#include "tools/probebox/view/live_feed.hpp"

#include <algorithm>

namespace probebox::view {
namespace {

constexpr std::size_t kMostSlots = 6000;  // as many as a page keeps: a minute, for an answer that takes its time

bool isWide(const messages::ChannelDescription& channel) {
  return channel.bytes > 4 || (channel.bytes == 4 && !channel.is_signed);
}

}  // namespace

void LiveFeed::Counts::add(std::int64_t count) {
  if (wide_) {
    wides_.push_back(count);
  } else {
    narrows_.push_back(static_cast<std::int32_t>(std::clamp<std::int64_t>(count, INT32_MIN, INT32_MAX)));
  }
}

void LiveFeed::Counts::clear() {
  narrows_.clear();
  wides_.clear();
}

void LiveFeed::describe(const messages::Descriptor& descriptor) {
  const auto same = [](const auto& channel, double scale, const Counts& counts) {
    return channel.scale == scale && isWide(channel) == counts.wide();
  };
  bool known = descriptor.channels.size() == scales_.size();
  for (std::size_t c = 0; known && c < scales_.size(); ++c) known = same(descriptor.channels[c], scales_[c], raw_[c]);
  if (known) return;
  scales_.clear();
  raw_.clear();
  slots_.clear();
  times_.clear();
  for (const auto& channel : descriptor.channels) {
    scales_.push_back(channel.scale);
    raw_.emplace_back(isWide(channel));
  }
}

double LiveFeed::scaled(std::size_t channel, std::int64_t count) const {
  return scales_[channel] * static_cast<double>(count);
}

void LiveFeed::add(const link::DecodedBlock& block) {
  const auto channels = block.descriptor.channels.size();
  if (channels != scales_.size()) return;
  for (std::size_t k = 0; k < block.header.count; ++k) {
    const auto at = toNs(codec::timeOf(block.header, block.header.first + static_cast<std::int64_t>(k)));
    if (!times_.empty() && at < times_.back()) {  // the box was restarted
      slots_.clear();
      times_.clear();
      for (auto& channel : raw_) channel.clear();
    }
    const auto number = at / kSlot_ns;
    const bool opens = slots_.empty() || slots_.back().number != number;
    if (opens) slots_.push_back({number, std::vector<Extent>(channels)});
    for (std::size_t c = 0; c < channels; ++c) {
      const auto value = block.column(c)[k];
      auto& extent = slots_.back().channels[c];
      extent = opens ? Extent{value, value} : Extent{std::min(extent.low, value), std::max(extent.high, value)};
      raw_[c].add(value);
    }
    times_.push_back(at);
  }
  while (times_.size() > kMostRaw) {
    times_.pop_front();
    for (auto& channel : raw_) channel.dropOldest();
  }
  while (slots_.size() > kMostSlots) slots_.pop_front();
}

Json LiveFeed::fresh() {
  if (slots_.size() < 2) return nullptr;
  Json numbers = Json::array(), low = Json::array(), high = Json::array();
  for (std::size_t c = 0; c < scales_.size(); ++c) {
    Json lows = Json::array(), highs = Json::array();
    for (std::size_t k = 0; k + 1 < slots_.size(); ++k) {
      lows.push_back(scaled(c, slots_[k].channels[c].low));
      highs.push_back(scaled(c, slots_[k].channels[c].high));
    }
    low.push_back(std::move(lows));
    high.push_back(std::move(highs));
  }
  for (std::size_t k = 0; k + 1 < slots_.size(); ++k) numbers.push_back(slots_[k].number);
  slots_.erase(slots_.begin(), slots_.end() - 1);
  return {{"slot_ns", kSlot_ns}, {"slots", numbers}, {"low", low}, {"high", high}};
}

LiveFeed::Extent LiveFeed::extentOf(std::size_t channel, std::size_t first, std::size_t end) const {
  Extent extent{raw_[channel].at(first), raw_[channel].at(first)};
  for (std::size_t k = first; k < end; ++k) {
    extent.low = std::min(extent.low, raw_[channel].at(k));
    extent.high = std::max(extent.high, raw_[channel].at(k));
  }
  return extent;
}

Json LiveFeed::window(std::int64_t from_ns, std::int64_t to_ns, std::size_t columns) const {
  const auto first = static_cast<std::size_t>(std::ranges::lower_bound(times_, from_ns) - times_.begin());
  const auto last = static_cast<std::size_t>(std::ranges::upper_bound(times_, to_ns) - times_.begin());
  Json times = Json::array(), low = Json::array(), high = Json::array();
  const auto count = last - std::min(first, last);
  const auto step = std::max<std::size_t>(1, (count + columns - 1) / std::max<std::size_t>(1, columns));
  for (std::size_t at = first; at < last; at += step) times.push_back(times_[at]);
  for (std::size_t c = 0; c < raw_.size(); ++c) {
    Json lows = Json::array(), highs = Json::array();
    for (std::size_t at = first; at < last; at += step) {
      const auto [least, most] = extentOf(c, at, std::min(last, at + step));
      lows.push_back(scaled(c, least));
      highs.push_back(scaled(c, most));
    }
    low.push_back(std::move(lows));
    high.push_back(std::move(highs));
  }
  return {{"times_ns", times}, {"low", low}, {"high", high}, {"samples_per_column", step}};
}

Json LiveFeed::newest() const {
  Json all = Json::array();
  for (std::size_t c = 0; c < raw_.size() && !times_.empty(); ++c) all.push_back(scaled(c, raw_[c].newest()));
  return all;
}

}  // namespace probebox::view
