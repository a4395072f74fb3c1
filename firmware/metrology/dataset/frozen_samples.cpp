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

// Noise of one resolution leaves two samples equal with a probability of 0.28: so many with one of 3e-11.
constexpr std::size_t kFewestSamples = 20;

// Values of one channel in one touch or scan, in the order of the table.
using Samples = std::vector<double>;

struct Stream {
  double first{};
  std::size_t count{};
  bool is_constant{true};
};

// Touches or scans in which the channel has one value other than 0 throughout.
std::vector<double> constantIn(const Samples& numbers, const Samples& values) {
  std::map<double, Stream> streams;
  Stream* stream = nullptr;  // rows of one touch stand together
  for (std::size_t row = 0; row < values.size(); ++row) {
    if (row == 0 || numbers[row] != numbers[row - 1])
      stream = &streams.try_emplace(numbers[row], values[row]).first->second;
    ++stream->count;
    stream->is_constant = stream->is_constant && values[row] == stream->first;
  }
  std::vector<double> found;
  for (const auto& [number, each] : streams)
    if (each.is_constant && each.first != 0 && each.count >= kFewestSamples) found.push_back(number);
  return found;
}

Samples samplesOf(double number, const Samples& numbers, const Samples& values) {
  Samples samples;
  for (std::size_t row = 0; row < values.size(); ++row)
    if (numbers[row] == number) samples.push_back(values[row]);
  return samples;
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

}  // namespace

std::optional<Refusal> frozenSamples(const Table& probe, std::string_view by) {
  const auto& numbers = *probe.column(by);
  for (const std::string_view name : column::kChannels) {
    const auto* values = probe.column(name);
    if (values == nullptr) continue;
    for (const double number : constantIn(numbers, *values)) {
      const auto hasNoise = [&](std::string_view other) {
        const auto* channel = probe.column(other);
        return channel != nullptr && hasClearNoise(samplesOf(number, numbers, *channel));
      };
      if (std::ranges::none_of(column::kChannels, hasNoise)) continue;
      const auto samples = samplesOf(number, numbers, *values);
      return Refusal{"frozen-channel",
                     "all " + std::to_string(samples.size()) + " samples of channel '" + std::string{name} + "' in " +
                         std::string{by} + " " + text(number) + " of table '" + probe.name + "' are " +
                         text(samples.front()) +
                         ", while the others have noise: check the channel's cable and where the file comes from, and "
                         "measure again; for a probe without this channel write 0"};
    }
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
