#include "firmware/metrology/scan/shape.hpp"

#include <array>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 5> kShapes{"box", "cylinder", "plane", "plane-pair", "sphere"};

}  // namespace

Outcome<std::string, Refusal> requiredShape(const Dataset& dataset) {
  TRY(const auto shape, configWord(dataset, "shape", kShapes));
  if (!shape)
    return Refusal{"missing-key", "config.json has no key 'shape': sphere, cylinder, plane-pair, box or plane"};
  return *shape;
}

}  // namespace probebox::metrology
