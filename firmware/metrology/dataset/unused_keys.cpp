#include "firmware/metrology/dataset/unused_keys.hpp"

#include <algorithm>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/known_keys.hpp"

namespace probebox::metrology {

std::vector<std::string> unusedKeys(const Dataset& dataset, std::span<const std::string_view> used) {
  std::vector<std::string> sentences;
  for (const auto& [key, value] : dataset.config) {
    if (std::ranges::find(used, key) == used.end() && !isCondition(key) && !isTypeBKey(dataset.method, key)) {
      sentences.push_back("config key '" + key + "' is not used by method " + dataset.method);
    }
  }
  return sentences;
}

}  // namespace probebox::metrology
