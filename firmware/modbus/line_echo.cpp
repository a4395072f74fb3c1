#include "firmware/modbus/line_echo.hpp"

#include <algorithm>

namespace probebox::modbus {

void LineEcho::sent(std::span<const std::uint8_t> answer) {
  size_ = std::min(answer.size(), answer_.size());
  matched_ = 0;
  judges_ = false;
  std::ranges::copy(std::as_bytes(answer.first(size_)), answer_.begin());
}

LineEcho::Passed LineEcho::strip(std::span<const std::byte> bytes) {
  if (!awaiting()) {
    judge(bytes);
    return {{}, bytes};
  }
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
  judges_ = !couldBeRequest() && line_ == Line::unknown;
  instead_size_ = 0;
  judge(held);
  judge(bytes);
  if (!couldBeRequest() && line_ == Line::echoes) learn(Line::unknown);
  repeats_ = 0;
  size_ = matched_ = 0;
  return {held, bytes};
}

void LineEcho::silence() {
  if (awaiting() && !couldBeRequest()) missed(matched_ == 0 ? 1 : 0);
  size_ = matched_ = 0;
  repeats_ = 0;
  judges_ = false;
}

// An answer did not come back. One that was damaged shows nothing about a line of which nothing is known.
void LineEcho::missed(int weight) {
  if (line_ == Line::echoes) return learn(Line::unknown);
  missed_ += weight;
  if (missed_ >= kEnough) learn(Line::does_not);
}

// A request in the place of an echo is the master's, unless it may be the echo of an earlier answer.
void LineEcho::judge(std::span<const std::byte> bytes) {
  if (!judges_) return;
  instead_size_ += copied(bytes, std::span{instead_}.subspan(instead_size_));
  const auto begun = std::span{instead_}.first(instead_size_);
  const auto begins = beginsRequest(begun);
  if (begins == Begins::undecided) return;
  judges_ = false;
  if (begins == Begins::request && begun[1] != static_cast<std::uint8_t>(Function::write_one)) missed(kEnough);
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
  missed_ = 0;
}

}  // namespace probebox::modbus
