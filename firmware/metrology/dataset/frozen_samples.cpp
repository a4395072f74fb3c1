#include "firmware/metrology/dataset/frozen_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

constexpr std::string_view kChannelNames[]{"a", "b", "c"};

// Noise of one resolution leaves two samples equal with a probability of 0.28: so many with one of 3e-11.
constexpr std::size_t kFewestSamples = 20;

// Values of one channel in one touch or scan, in the order of the table.
using Samples = std::vector<double>;

bool isConstant(const Samples& samples) {
  return std::ranges::all_of(samples, [&](double sample) { return sample == samples.front(); });
}

// True where the noise, by the median of second differences, which a smooth motion leaves alone, is at least the
// smallest step between two samples.
bool hasClearNoise(const Samples& samples) {
  constexpr double kOfSecondDifferences = 1.4826 / 2.4495;  // median to sd of a Gaussian; root of 1 + 4 + 1
  double step = std::numeric_limits<double>::infinity();
  std::vector<double> bends;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double change = std::abs(samples[i] - samples[i - 1]);
    if (change > 0) step = std::min(step, change);
    if (i + 1 < samples.size()) bends.push_back(std::abs(samples[i + 1] - 2 * samples[i] + samples[i - 1]));
  }
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::ranges::nth_element(bends, middle);
  return kOfSecondDifferences * *middle >= step;
}

// Channels of the touches or scans, by the number in the first column.
std::map<double, std::map<std::string_view, Samples>> streamsOf(const Table& table) {
  std::map<double, std::map<std::string_view, Samples>> streams;
  const auto& numbers = table.columns.front().values;
  for (const auto name : kChannelNames) {
    const auto* values = table.column(name);
    if (values == nullptr) continue;
    Samples* samples = nullptr;  // rows of one touch stand together
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (row == 0 || numbers[row] != numbers[row - 1]) samples = &streams[numbers[row]][name];
      samples->push_back((*values)[row]);
    }
  }
  return streams;
}

}  // namespace

std::optional<Refusal> frozenSamples(const Table& probe) {
  for (const auto& [number, channels] : streamsOf(probe)) {
    for (const auto& [name, samples] : channels) {
      if (samples.size() < kFewestSamples || samples.front() == 0 || !isConstant(samples)) continue;
      if (std::ranges::none_of(channels, [](const auto& other) { return hasClearNoise(other.second); })) continue;
      return Refusal{"frozen-channel",
                     "all " + std::to_string(samples.size()) + " samples of channel '" + std::string{name} + "' in " +
                         probe.columns.front().name + " " + text(number) + " of table '" + probe.name + "' are " +
                         text(samples.front()) +
                         ", while the others have noise: check the channel's cable and where the file comes from, and "
                         "measure again; for a probe without this channel write 0"};
    }
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
