#include "host-tests/emulation/hosts.hpp"

#include <algorithm>

#include "firmware/app/results/result_summary.hpp"
#include "host-tests/emulation/streamed.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

}  // namespace

io::Transfer WireEnd::read(std::span<std::byte> into) {
  if (in_->blocked) return {};
  const auto count = std::min(into.size(), in_->bytes.size());
  std::copy_n(in_->bytes.begin(), count, into.begin());
  in_->bytes.erase(in_->bytes.begin(), in_->bytes.begin() + static_cast<std::ptrdiff_t>(count));
  return {count, in_->cut && in_->bytes.empty() ? io::PipeState::closed : io::PipeState::open};
}

io::Transfer WireEnd::write(std::span<const std::byte> from) {
  if (out_->cut) return {0, io::PipeState::closed};
  const auto count = std::min(from.size(), out_->room - std::min(out_->room, out_->bytes.size()));
  out_->bytes.insert(out_->bytes.end(), from.begin(), from.begin() + static_cast<std::ptrdiff_t>(count));
  return {count, io::PipeState::open};
}

void VirtualHost::connect(const stream::SessionOptions& session, const stream::History& history) {
  to_host_ = std::make_shared<WireState>();
  to_box_ = std::make_shared<WireState>();
  cut_after_.reset();
  asked_ = false;
  link_ = std::make_unique<app::HostLink>(++connections_, io::Connection{std::make_unique<WireEnd>(to_box_, to_host_)},
                                          session, history);
  link::ClientOptions options;
  options.last_boot_id = boot_id_;
  options.silence = std::chrono::hours{1};  // a host that does not read hears nothing
  client_ = std::make_unique<link::Client>(io::Connection{std::make_unique<WireEnd>(to_host_, to_box_)}, options,
                                           static_cast<link::StreamListener*>(this));
}

void VirtualHost::carry(MonoTime now, const stream::Vitals& vitals) {
  if (!client_) return;
  link_->receive(now);
  link_->session().advance(now, vitals);
  const auto before = to_host_->bytes.size();
  link_->flush();
  if (cut_after_) {
    const auto came = to_host_->bytes.size() - before;
    if (came > *cut_after_) {
      to_host_->bytes.resize(before + *cut_after_);
      to_host_->cut = to_box_->cut = true;
    } else {
      *cut_after_ -= came;
    }
  }
  if (client_->poll(now) == link::LinkState::lost) return hangUp();
  if (client_->state() != link::LinkState::ready || asked_) return;
  asked_ = true;
  messages::Start start;
  start.profile = options_.profile;
  start.policy = options_.policy;
  start.has_resume = first_.has_value();
  start.resume_from = next_;
  start.triggers = true;
  start.triggers_from = next_trigger_;
  client_->start(start);
}

void VirtualHost::stopReading(bool stopped) {
  to_host_->blocked = stopped;
}

void VirtualHost::hangUp() {
  faults_ += client_->reader().counters().bad();
  client_.reset();
  link_.reset();
}

std::uint64_t VirtualHost::declaredLost(messages::GapReason reason) const {
  return by_reason_[static_cast<std::size_t>(reason)];
}

// A resumed stream begins with the block that holds the first missing sample.
std::uint64_t VirtualHost::newOf(SampleIndex first, std::uint64_t count) {
  const auto end = first + static_cast<std::int64_t>(count);
  if (!first_) first_ = next_ = first;
  if (first > next_) ++faults_;
  if (end <= next_) return 0;
  const auto fresh = static_cast<std::uint64_t>(end - next_);
  next_ = end;
  return fresh;
}

void VirtualHost::onBlock(const link::DecodedBlock& block) {
  received_ += newOf(block.header.first, block.header.count);
}

void VirtualHost::onGap(const messages::Gap& gap) {
  const auto fresh = newOf(gap.first, gap.count);
  declared_ += fresh;
  by_reason_[static_cast<std::size_t>(gap.reason)] += fresh;
}

void VirtualHost::onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) {
  ++heartbeats_;
  faults_ += balance && !balance->exact ? 1U : 0U;
  faults_ += client_ && !client_->reader().triggers().exact() ? 1U : 0U;
  next_trigger_ = std::max(next_trigger_, beat.next_trigger);
}

void VirtualHost::onTrigger(const messages::Trigger& trigger) {
  if (trigger.number < next_trigger_) ++faults_;
  next_trigger_ = trigger.number + 1;
  triggers_.push_back(trigger);
}

void VirtualHost::onTriggerGap(const messages::TriggerGap& gap) {
  lost_triggers_ += gap.count;
  next_trigger_ = gap.first + gap.count;
}

Office::Office(std::size_t history_bytes, std::size_t triggers, const world::Config& config, std::uint64_t seed)
    : history_bytes_{history_bytes},
      triggers_{triggers},
      transcoder_{box::channelFormats(), box::BlockBuilder::kMostSamples},
      scenario_{config, seed} {
  boot();
  scenario_.recorder().keeps_bytes = false;
  scenario_.recorder().also = this;
}

Office::~Office() = default;

void Office::boot() {
  history_ = std::make_unique<stream::History>(history_bytes_, 4096, std::vector{messages::Profile::fast},
                                               stream::TriggerHistory{triggers_});
  history_->setDescriptor(messages::encoded(streamedDescriptor("office", 2)));
  session_.boot_id.fill(static_cast<std::byte>(++boots_));
}

VirtualHost& Office::add(const StreamOptions& options) {
  auto& host = *hosts_.emplace_back(std::make_unique<VirtualHost>(options));
  connect(host);
  return host;
}

void Office::connect(VirtualHost& host) {
  host.connect(session_, *history_);
}

void Office::run(Nanoseconds duration) {
  constexpr Nanoseconds kRound = 10ms;
  for (Nanoseconds done{}; done < duration; done += kRound) {
    scenario_.run(kRound);
    for (const auto& host : hosts_) host->carry(scenario_.now(), {});
  }
}

void Office::restartBox(std::span<const Event> restored) {
  for (const auto& host : hosts_) {
    host->cutAfter(0);
    host->carry(scenario_.now(), {});
    if (host->connected()) host->hangUp();
  }
  boot();
  scenario_.restartBox(restored);
}

bool Office::block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) {
  history_->reachTrigger(scenario_.box().nextTrigger());
  const stream::EncodedBlock raw{.first = first, .count = count, .bytes = bytes};
  offer(raw);
  offer(transcoder_.fast(raw));
  return true;
}

void Office::offer(const stream::EncodedBlock& block) {
  history_->push(block);
  for (const auto& host : hosts_)
    if (auto* session = host->session()) session->offer(block);
}

bool Office::lost(const latch::Lost& lost) {
  const auto gap = streamedGap(lost);
  history_->push(gap);
  for (const auto& host : hosts_)
    if (auto* session = host->session()) session->offer(gap);
  return true;
}

void Office::trigger(const box::PlacedTrigger& trigger) {
  history_->push(app::wireTrigger(trigger));
}

}  // namespace probebox::scenario
