#include "tools/replay/recorded_stream.hpp"

#include <array>

#include "protocol/units/plain_input.hpp"

namespace probebox::replay {

Outcome<std::unique_ptr<RecordedStream>> RecordedStream::open(const std::string& path, link::StreamListener* listener) {
  TRY(auto file, openPlainInput(path));
  std::unique_ptr<RecordedStream> stream{new RecordedStream{std::move(file), listener}};
  while (!stream->first_ && !stream->over_ && stream->readMore()) {
  }
  if (!stream->first_)
    return Error{
        path +
        ": does not describe its channels: it is not a recording, its beginning is missing, or it ends too early"};
  return stream;
}

std::optional<Recorded> RecordedStream::next() {
  while (waiting_.empty() && !over_ && readMore()) {
  }
  if (waiting_.empty()) return std::nullopt;
  auto first = std::move(waiting_.front());
  waiting_.pop_front();
  return first;
}

bool RecordedStream::readMore() {
  std::array<std::byte, 16384> buffer{};
  if (!file_) return false;
  file_.read(reinterpret_cast<char*>(buffer.data()), static_cast<std::streamsize>(buffer.size()));
  const auto got = static_cast<std::size_t>(file_.gcount());
  reader_.read(std::span{buffer}.first(got));
  bytes_ += got;
  return true;
}

link::RecordingEnd RecordedStream::end() {
  while (readMore()) waiting_.clear();
  return link::endOf(reader_, bytes_);
}

void RecordedStream::onWelcome(const messages::Welcome& welcome) {
  listener_.onWelcome(welcome);
  over_ = over_ || (boot_id_ && *boot_id_ != welcome.boot_id);
  boot_id_ = welcome.boot_id;
}

void RecordedStream::onDescriptor(const messages::Descriptor& descriptor) {
  if (!first_) first_ = descriptor;
}

// The descriptor that the block belongs to goes ahead of it.
void RecordedStream::onBlock(const link::DecodedBlock& block) {
  listener_.onBlock(block);
  if (over_ || (next_ && block.header.first < *next_)) return;
  if (auto encoded = messages::encoded(block.descriptor); encoded != described_) {
    described_ = std::move(encoded);
    waiting_.emplace_back(block.descriptor);
  }
  std::vector<codec::ChannelFormat> formats;
  for (const auto& channel : block.descriptor.channels) formats.push_back({channel.bytes, channel.is_signed});
  RecordedBlock made{block.header, {}, {}};
  made.raw.resize(codec::rawBlockSize(formats, block.header.count));
  made.fast.resize(made.raw.size());
  const auto raw = codec::encodeRaw(block.header, formats, block.columns, made.raw);
  const auto fast = codec::encodeFast(block.header, formats, block.columns, made.fast);
  made.raw.resize(raw ? *raw : 0);
  if (fast) {
    made.fast.resize(*fast);
  } else {
    made.fast = made.raw;  // longer than a box's blocks; each says for itself how it is coded
  }
  next_ = block.header.first + static_cast<std::int64_t>(block.header.count);
  waiting_.emplace_back(std::move(made));
}

void RecordedStream::onGap(const messages::Gap& gap) {
  listener_.onGap(gap);
  add(gap);
}

void RecordedStream::onHole(const messages::Gap& hole) {
  listener_.onHole(hole);
  add(hole);
}

void RecordedStream::add(const messages::Gap& gap) {
  const auto end = gap.first + static_cast<std::int64_t>(gap.count);
  if (over_ || (next_ && end <= *next_)) return;
  waiting_.emplace_back(gap);
  next_ = end;
}

void RecordedStream::onTrigger(const messages::Trigger& trigger) {
  listener_.onTrigger(trigger);
  if (!over_) waiting_.emplace_back(trigger);
}

void RecordedStream::onTriggerGap(const messages::TriggerGap& gap) {
  listener_.onTriggerGap(gap);
  add(gap);
}

void RecordedStream::onTriggerHole(const messages::TriggerGap& hole) {
  listener_.onTriggerHole(hole);
  add(hole);
}

void RecordedStream::onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) {
  listener_.onHeartbeat(beat, balance);
}

void RecordedStream::add(const messages::TriggerGap& gap) {
  if (!over_) waiting_.emplace_back(gap);
}

}  // namespace probebox::replay
