#include "tools/probebox/text/report_indexes.hpp"

#include <string>

namespace probebox::command {

std::vector<metrology::Finding> silentIndexes(const std::vector<messages::LineStatus>& lines,
                                              std::span<const published::AxisState> axes) {
  constexpr std::uint8_t kIndex = 2;
  std::vector<metrology::Finding> findings;
  for (const auto& line : lines) {
    if (line.role != kIndex || line.edges > 0 || line.line >= axes.size() || axes[line.line].referenced) continue;
    const std::string axis{"XYZ"[line.line % 3U]};
    findings.push_back({false, "index-missing",
                        line.name + " has given no pulse, and " + axis + " is not referenced: drive " + axis +
                            " over its mark. If it stays silent, check the Z signal of its encoder, its line receiver, "
                            "and [[index]] or 'index' of [encoder." +
                            axis + "] in box.toml."});
  }
  return findings;
}

}  // namespace probebox::command
