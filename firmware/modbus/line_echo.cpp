#include "firmware/modbus/line_echo.hpp"

#include <algorithm>

namespace probebox::modbus {

void LineEcho::sent(std::span<const std::uint8_t> answer) {
  size_ = std::min(answer.size(), answer_.size());
  matched_ = 0;
  std::ranges::copy(std::as_bytes(answer.first(size_)), answer_.begin());
}

LineEcho::Passed LineEcho::strip(std::span<const std::byte> bytes) {
  if (!awaiting()) return {{}, bytes};
  const auto expected = std::span{answer_}.subspan(matched_, size_ - matched_);
  const auto [came, awaited] = std::ranges::mismatch(bytes, expected);
  const auto alike = static_cast<std::size_t>(came - bytes.begin());
  const auto held = std::span{answer_}.first(matched_);
  matched_ += alike;
  if (matched_ == size_) {
    const bool master = passes();
    const auto all = std::span{answer_}.first(size_);
    size_ = matched_ = 0;
    return {master ? all : std::span<const std::byte>{}, bytes.subspan(alike)};
  }
  if (alike == bytes.size()) return {};
  if (!couldBeRequest()) learn(Line::does_not);
  repeats_ = 0;
  size_ = matched_ = 0;
  return {held, bytes};
}

void LineEcho::silence() {
  if (awaiting() && !couldBeRequest()) learn(Line::does_not);
  size_ = matched_ = 0;
  repeats_ = 0;
}

// A write of one register is answered by itself; no other answer has the form of a request.
bool LineEcho::couldBeRequest() const {
  return size_ > 1 && answer_[1] == static_cast<std::byte>(Function::write_one);
}

// The whole answer has come back: whether the master sent it.
bool LineEcho::passes() {
  bool master = false;
  if (!couldBeRequest()) {
    learn(Line::echoes);
  } else if (line_ == Line::unknown) {
    master = repeats_ < kMostRepeats;
    repeats_ += master ? 1 : 0;
  } else {
    master = line_ == Line::does_not;
  }
  if (!master) ++removed_;
  return master;
}

void LineEcho::learn(Line line) {
  line_ = line;
  repeats_ = 0;
}

}  // namespace probebox::modbus
