#include "gate_entry.hpp"

#include <algorithm>
#include <span>

#include "firmware/stream/greeting.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;
using Gate = stream::HelloGate;

}  // namespace

// data[0]: how finely the bytes come. Whatever comes, the gate takes no more than it has room for, decides for good,
// and never lets a line of text in.
int feedGate(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  if (size < 1) return 0;
  const std::size_t piece = 1 + data[0];
  auto bytes = std::as_bytes(std::span{data + 1, size - 1});
  const auto all = bytes;
  Gate gate;
  auto verdict = Gate::Verdict::undecided;
  while (!bytes.empty() && verdict == Gate::Verdict::undecided && gate.room() > 0) {
    const auto taken = bytes.first(std::min({piece, bytes.size(), gate.room()}));
    bytes = bytes.subspan(taken.size());
    verdict = gate.push(taken);
  }
  const std::size_t fed = all.size() - bytes.size();
  require(gate.bytes().size() <= Gate::kMostBytes);
  if (verdict == Gate::Verdict::undecided) require(fed < Gate::kMostBytes);
  if (verdict != Gate::Verdict::hello) return 0;
  require(std::ranges::equal(gate.bytes(), all.first(fed)));
  // What was let in begins with a frame of ours in COBS: a browser cannot choose these bytes.
  const auto first = std::ranges::find_if(all, [](std::byte each) { return each != std::byte{0}; });
  require(all.end() - first > 2 && first[0] == std::byte{3} && first[2] == std::byte{1});
  return 0;
}
