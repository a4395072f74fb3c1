#include "firmware/modbus/register_image.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::modbus {

RegisterImage::RegisterImage() {
  fill({}, {}, nullptr, WordOrder::high_first);
}

void RegisterImage::put(std::size_t address, double value) {
  // Every address here is one of the map's; the test of the image would not get past a null.
  const auto at = static_cast<std::uint16_t>(address);
  encodeAt(*find(at), at, value, order_, image_);
}

std::uint16_t RegisterImage::serve(const published::Snapshot& snapshot) {
  unsigned status = published::statusOf(snapshot);
  for (std::size_t axis = 0; axis < served_mm_.size(); ++axis) {
    const double wanted = snapshot.correction_mm[axis];
    if (std::isfinite(wanted)) {
      served_mm_[axis] = std::clamp(wanted, -kCorrectionLimitMm, kCorrectionLimitMm);
    } else {
      status &= ~static_cast<unsigned>(published::kValid);
    }
    if (served_mm_[axis] != wanted) status |= published::kDegraded;
  }
  return static_cast<std::uint16_t>(status);
}

void RegisterImage::fill(const published::Snapshot& snapshot, const published::LineState& line, const Results& results,
                         WordOrder order) {
  static const published::ServedResults kNone{};
  order_ = order;
  const auto status = serve(snapshot);
  const RegisterInputs inputs{snapshot, line, results ? *results : kNone, served_mm_, status};
  for (const auto& entry : modbus::registers())
    if (entry.value != nullptr) encode(entry, entry.value(inputs, entry.part), order, image_);
  if (!results || (results == shown_ && order == shown_in_)) return;
  putResults(*results);
  shown_ = results;
  shown_in_ = order;
}

}  // namespace probebox::modbus
