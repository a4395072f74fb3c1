// Decodes what the front end's image sent with the box's own decoder and compares it with what was on its pins.
// front_end_compare FILE: of scenario.mjs, which says what its lines mean. Names each difference; fails with any.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/usb_probe/decode.hpp"
#include "drivers/usb_probe/packet_reader.hpp"
#include "firmware/front_end/core/assembly.hpp"
#include "protocol/receiver/front_end.hpp"

namespace {

using namespace probebox;
using usb_probe::ReceiverFault;

// Cycles of the chip. A count is latched within so many of the sample: a loop of the counter, the DMA, and the
// emulator's grain, which is an instruction. A stamp is right to a step; to three where another line changed at the
// time.
constexpr std::int64_t kLatchEarly = 40, kLatchLate = 60;
constexpr double kStamp = front_end::kCyclesAStep, kStampBeside = 3 * kStamp;
constexpr std::size_t kComparedPackets = 4;
constexpr std::int64_t kBeside = 2 * std::int64_t{front_end::kCyclesAStep};

struct Taken {
  std::int64_t cycle{};
  std::array<std::int32_t, 3> raw{};
  bool silent{};
};
struct Change {
  std::int64_t cycle{}, value{};
};
struct LineChange {
  std::int64_t cycle{};
  unsigned line{}, level{};
};

struct Truth {
  std::vector<Taken> samples;
  std::array<std::vector<Change>, front_end::kCounters> counts, pulses, illegal, wires;
  std::vector<LineChange> edges;
  std::vector<std::vector<std::byte>> transfers;
};

Truth read(const char* path) {
  Truth truth;
  std::ifstream file{path};
  for (std::string line; std::getline(file, line);) {
    std::istringstream words{line};
    char kind{};
    std::int64_t cycle{};
    words >> kind >> cycle;
    unsigned which{};
    std::int64_t value{};
    switch (kind) {
      case 'S': {
        Taken taken{cycle};
        words >> taken.raw[0] >> taken.raw[1] >> taken.raw[2] >> taken.silent;
        truth.samples.push_back(taken);
        break;
      }
      case 'E':
        words >> which >> value;
        truth.edges.push_back({cycle, which, static_cast<unsigned>(value)});
        break;
      case 'P': {
        std::string hex;
        words >> hex;
        auto& bytes = truth.transfers.emplace_back();
        for (std::size_t i = 0; i < hex.size(); i += 2)
          bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
        break;
      }
      default:
        words >> which >> value;
        (kind == 'C'   ? truth.counts
         : kind == 'Z' ? truth.pulses
         : kind == 'I' ? truth.illegal
                       : truth.wires)
            .at(which)
            .push_back({cycle, value});
    }
  }
  std::ranges::sort(truth.samples, {}, &Taken::cycle);
  return truth;
}

class Comparison {
 public:
  explicit Comparison(const Truth& truth) : truth_{truth}, sent_edges_(usb_probe::kReceiverLines) {}

  void run() {
    usb_probe::PacketReader reader;
    for (const auto& transfer : truth_.transfers) {
      std::span<const std::byte> bytes{transfer};
      reader.beginTransfer(bytes);
      while (const auto packet = reader.next(bytes)) take(*packet);
      if (reader.unfinished() != 0) differs("a transfer does not end with its packet");
    }
    if (reader.counters().bad() != 0 || reader.counters().discarded_bytes != 0) differs("there are damaged packets");
    if (samples_ < 20) differs("there are too few samples");
    compareEdges();
    comparePulses();
    compareFaults();
    compareEvents();
    if (truth_.illegal[0].empty()) compareCore();
    std::cout << samples_ << " samples, " << edges_ << " edges (worst stamp " << worst_stamp_ << " cycles), " << pulses_
              << " index pulses compared\n";
  }
  bool good() const { return differences_ == 0; }

 private:
  template <class... Parts>
  void differs(const Parts&... parts) {
    if (++differences_ <= 20) (std::cout << ... << parts) << '\n';
  }

  // Counts that a counter had from some cycles before to some after.
  std::pair<std::int64_t, std::int64_t> countsAround(unsigned counter, std::int64_t cycle) const {
    const auto& counts = truth_.counts.at(counter);
    auto change = std::ranges::upper_bound(counts, cycle - kLatchEarly, {}, &Change::cycle);
    std::int64_t least = change == counts.begin() ? 0 : std::prev(change)->value, most = least;
    for (; change != counts.end() && change->cycle <= cycle + kLatchLate; ++change) {
      least = std::min(least, change->value);
      most = std::max(most, change->value);
    }
    return {least, most};
  }
  bool isDoubtful(unsigned counter, std::int64_t cycle) const {
    const auto& illegal = truth_.illegal.at(counter);
    return !illegal.empty() && cycle + kLatchLate >= illegal.front().cycle;
  }

  void take(const usb_probe::Packet& packet) {
    if (packet.header.version != 3) differs("version ", int{packet.header.version});
    if (samples_ > 0 && packet.header.first != next_) differs("samples are missing before ", packet.header.first);
    next_ = packet.header.first + packet.header.count;
    steps_ = packet.of_edges.steps_a_sample;
    faults_ |= packet.of_edges.faults;
    for (std::size_t i = 0; i < packet.header.count; ++i) takeSample(packet, i);
    for (std::size_t i = 0; i < packet.of_edges.edges; ++i) {
      const auto edge = packet.edge(i);
      if (edge.line < sent_edges_.size()) sent_edges_[edge.line].push_back(edge);
    }
    for (std::size_t i = 0; i < packet.more.latches; ++i) latches_.push_back(packet.latch(i));
  }

  void takeSample(const usb_probe::Packet& packet, std::size_t i) {
    const std::size_t number = packet.header.first + i;
    if (number >= truth_.samples.size()) return differs("a sample ", number, " that was not taken");
    const auto& taken = truth_.samples[number];
    const auto sample = packet.sample(i);
    ++samples_;
    for (unsigned k = 0; k < front_end::kCounters; ++k) {
      const auto [least, most] = countsAround(k, taken.cycle);
      const auto count = packet.count(i, k);
      if (!isDoubtful(k, taken.cycle) && (count < least || count > most))
        differs("sample ", number, ": counter ", k, " has ", count, ", was from ", least, " to ", most);
      const bool fault = (unsigned{sample.status} >> (usb_probe::status::kFirstCounterFault + k) & 1U) != 0;
      if (fault) faulty_[k] = true;
      if (fault && truth_.illegal[k].empty() && truth_.wires[k].empty())
        differs("sample ", number, ": counter ", k, " has a fault without a cause");
    }
    bool clipped = taken.silent;
    for (std::size_t c = 0; c < 3; ++c) {
      clipped = clipped || std::abs(taken.raw[c]) > 32'700;
      const auto nm = static_cast<std::int32_t>(std::int64_t{1'000'000} * taken.raw[c] / 32'768);
      if (!taken.silent && sample.channels_nm[c] != nm)
        differs("sample ", number, ": channel ", c, " has ", sample.channels_nm[c], " nm, was ", nm);
    }
    if (((sample.status & usb_probe::status::kClipped) != 0) != clipped) differs("sample ", number, ": clipped");
  }

  double cycleOf(std::uint32_t sample, std::uint32_t fraction) const {
    const double period = static_cast<double>(steps_) * front_end::kCyclesAStep;
    return static_cast<double>(truth_.samples.front().cycle) + period * (sample + std::ldexp(fraction, -32));
  }
  bool isAlone(std::int64_t cycle) const {
    return std::ranges::count_if(truth_.edges,
                                 [&](const auto& edge) { return std::abs(edge.cycle - cycle) <= kBeside; }) == 1;
  }

  // Edges after the last packet are not sent yet.
  void compareEdges() {
    std::array<std::size_t, usb_probe::kReceiverLines> next{};
    for (const auto& was : truth_.edges) {
      const auto& sent = sent_edges_[was.line];
      const std::size_t i = next[was.line]++;
      if (i >= sent.size()) {
        if (static_cast<double>(was.cycle) < cycleOf(next_ - 1, 0))
          differs("an edge of line ", was.line, " is missing");
        continue;
      }
      const auto& edge = sent[i];
      const double error = cycleOf(edge.sample, edge.fraction) - static_cast<double>(was.cycle);
      if (std::abs(error) > (isAlone(was.cycle) ? kStamp : kStampBeside))
        differs("edge ", i, " of line ", was.line, ": ", error, " cycles off");
      if (isAlone(was.cycle)) worst_stamp_ = std::max(worst_stamp_, std::abs(error));
      if (edge.level != was.level || edge.sequence != static_cast<std::uint16_t>(i + 1) || edge.lost != 0)
        differs("edge ", i, " of line ", was.line, ": level, sequence or lost");
      ++edges_;
    }
    for (std::size_t line = 0; line < sent_edges_.size(); ++line)
      if (sent_edges_[line].size() > next.at(line)) differs("edges of line ", line, " that were not there");
  }

  void comparePulses() {
    std::array<std::size_t, front_end::kCounters> next{};
    for (const auto& latch : latches_) {
      const auto& pulses = truth_.pulses.at(latch.counter);
      if (next[latch.counter] >= pulses.size()) {
        differs("an index pulse of counter ", int{latch.counter}, " that was not there");
        continue;
      }
      const auto& was = pulses[next[latch.counter]++];
      const double error = cycleOf(latch.sample, latch.fraction) - static_cast<double>(was.cycle);
      if (std::abs(error) > kStamp) differs("an index pulse is ", error, " cycles off");
      const auto [least, most] = countsAround(latch.counter, was.cycle);
      if (latch.counts < least || latch.counts > most)
        differs("an index pulse at ", latch.counts, ", was from ", least, " to ", most);
      ++pulses_;
    }
    for (std::size_t k = 0; k < front_end::kCounters; ++k)
      for (std::size_t i = next.at(k); i < truth_.pulses.at(k).size(); ++i)
        if (static_cast<double>(truth_.pulses.at(k)[i].cycle) < cycleOf(next_ - 1, 0))
          differs("an index pulse is missing");
  }

  void compareFaults() {
    const double end = cycleOf(next_ - 1, 0);
    unsigned expected = 0;
    const auto before = [&](const auto& changes) {
      return !changes.empty() && static_cast<double>(changes.front().cycle) < end;
    };
    for (unsigned k = 0; k < front_end::kCounters; ++k) {
      if (before(truth_.wires[k])) expected |= unsigned{bitOf(ReceiverFault::wires_1)} << k;
      if ((before(truth_.illegal[k]) || before(truth_.wires[k])) != faulty_[k]) differs("fault of counter ", k);
    }
    for (std::size_t i = 0; i < next_; ++i)
      if (truth_.samples[i].silent) expected |= bitOf(ReceiverFault::converter_silent);
    // A counter may have been too fast where A and B changed at once.
    if (std::ranges::any_of(truth_.illegal, before)) faults_ &= ~unsigned{bitOf(ReceiverFault::counter_overrun)};
    if (faults_ != expected) differs("faults ", faults_, ", expected ", expected);
  }

  static std::array<std::uint32_t, front_end::kCounters> countsOf(const usb_probe::Packet& packet, std::size_t sample) {
    std::array<std::uint32_t, front_end::kCounters> counts{};
    for (std::size_t k = 0; k < counts.size(); ++k) counts[k] = static_cast<std::uint32_t>(packet.count(sample, k));
    return counts;
  }
  static void take(front_end::Assembly& core, const front_end::Latched& latched) {
    core.sample(latched);
    for (int parts = 0; parts < 50; ++parts) core.work();
    if (core.packets().front() != nullptr && !latched.has_deflection) core.taken();
  }

  // The image's core and that of this computer, compiled from the same sources, make the same bytes of what the
  // hardware latched, which the packets tell: up to the first sample with a fault, because when the host took a packet
  // they do not tell.
  void compareCore() {
    const auto core = std::make_unique<front_end::Assembly>();
    const front_end::Settings settings;
    unsigned levels = 0;
    std::size_t packets = 0, number = 0;
    for (const auto& transfer : truth_.transfers) {
      const auto packet = usb_probe::decodePacket(transfer);
      if (!packet || packet->of_edges.faults != 0 || packet->of_edges.steps_a_sample != settings.steps_a_sample) break;
      if (packets == 0) {
        core->start(settings, packet->header.run);
        for (; number < packet->header.first; ++number)
          take(*core, {.counts = countsOf(*packet, 0)});  // nobody listened
        while (core->packets().front() != nullptr) core->taken();
      }
      if (packet->header.first != number) break;
      const auto stampOf = [&](std::uint32_t sample, std::uint32_t fraction, unsigned pins) {
        const double half_steps = std::ldexp(fraction, -32) * 2 * settings.steps_a_sample;
        const auto step = static_cast<std::uint32_t>((std::llround(half_steps) + 1) / 2);
        return (0U - (sample * settings.steps_a_sample + step)) << front_end::kStampedPins | pins;
      };
      for (std::size_t i = 0; i < packet->of_edges.edges; ++i) {
        const auto edge = packet->edge(i);
        levels = edge.level != 0 ? levels | 1U << edge.line : levels & ~(1U << edge.line);
        const bool with_next = i + 1 < packet->of_edges.edges && packet->edge(i + 1).sample == edge.sample &&
                               packet->edge(i + 1).fraction == edge.fraction;
        if (!with_next) core->lines(stampOf(edge.sample, edge.fraction, levels));
      }
      for (std::size_t i = 0; i < packet->more.latches; ++i) {
        const auto latch = packet->latch(i);
        std::array<std::uint32_t, front_end::kCounters> counts{};
        counts.at(latch.counter) = static_cast<std::uint32_t>(latch.counts);
        core->index(stampOf(latch.sample, latch.fraction, 1U << latch.counter), counts);
        core->index(stampOf(latch.sample, latch.fraction, 0), counts);
      }
      bool faulty = false;
      for (std::size_t i = 0; i < packet->header.count; ++i, ++number) {
        const auto& taken = truth_.samples.at(number);
        faulty = faulty || packet->sample(i).status >> usb_probe::status::kFirstCounterFault != 0 || taken.silent;
        front_end::Latched latched{.counts = countsOf(*packet, i), .has_deflection = true};
        for (std::size_t c = 0; c < latched.deflection.size(); ++c)
          latched.deflection[c] = static_cast<std::int16_t>(taken.raw[c]);
        take(*core, latched);
      }
      if (faulty) break;
      const auto* const made = core->packets().front();
      if (made == nullptr || !std::ranges::equal(std::span{made->bytes}.first(made->size), transfer))
        return differs("packet ", packets, " of the core differs from that of the image");
      core->taken();
      ++packets;
    }
    if (packets < kComparedPackets) differs("only ", packets, " packets without a fault");
    std::cout << packets << " packets are byte for byte those of the core on this computer\n";
  }

  // As the box sees it: every sample with its counts, pulse and edge is an event, in the order of their times.
  void compareEvents() {
    usb_probe::CounterAxes axes{};
    for (std::uint8_t k = 0; k < front_end::kCounters; ++k) axes[k] = {.axis = k, .has_index = true};
    const usb_probe::WiredLines lines{usb_probe::WiredLine{LineRole::sync}, usb_probe::WiredLine{LineRole::trigger},
                                      usb_probe::WiredLine{LineRole::skip}, usb_probe::WiredLine{LineRole::inhibit},
                                      usb_probe::WiredLine{LineRole::trigger, 1}};
    const auto decoder = std::make_unique<usb_probe::ReceiverDecoder>(axes, lines);
    std::size_t samples = 0, counted = 0, pulses = 0, edges = 0;
    double last = -1;
    const auto takeAt = [&](std::uint32_t counter, std::uint32_t fraction) {
      const double at = counter + std::ldexp(fraction, -32);
      if (at < last) differs("an event at ", at, " comes after one at ", last);
      last = at;
    };
    std::array<Event, 64> events;
    for (const auto& transfer : truth_.transfers) {
      std::span<const std::byte> bytes{transfer};
      decoder->begin(bytes, {}, true);
      while (const auto count = decoder->read(bytes, events))
        for (const auto& event : std::span{events}.first(count)) {
          if (const auto* const sample = std::get_if<CountedDeflection>(&event)) ++samples, takeAt(sample->counter, 0);
          if (std::holds_alternative<CountedAxes>(event)) ++counted;
          if (const auto* const pulse = std::get_if<CountedIndex>(&event))
            ++pulses, takeAt(pulse->counter, pulse->fraction);
          const auto* const edge = std::get_if<CountedEdge>(&event);
          if (edge == nullptr) continue;
          ++edges;
          if (edge->fraction != 0) takeAt(edge->counter, edge->fraction);  // 0: the level that a line begins with
        }
    }
    std::size_t sent = 0;
    for (const auto& line : sent_edges_) sent += line.size();
    // Beside the edges: the levels of lines, but sync, that begin without one.
    const bool edges_fit = edges >= sent && edges <= sent + 4;
    if (samples != samples_ || counted != samples_ || pulses != latches_.size() || !edges_fit)
      differs("the box decodes ", samples, " samples, ", counted, " counts, ", pulses, " pulses, ", edges, " edges");
  }

  const Truth& truth_;
  std::vector<std::vector<usb_probe::LineEdge>> sent_edges_;
  std::vector<usb_probe::IndexLatch> latches_;
  std::array<bool, front_end::kCounters> faulty_{};
  std::uint32_t next_{}, steps_{};
  unsigned faults_{};
  std::size_t samples_{}, edges_{}, pulses_{}, differences_{};
  double worst_stamp_{};
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return EXIT_FAILURE;
  const auto truth = read(argv[1]);
  if (truth.samples.empty()) return EXIT_FAILURE;
  Comparison comparison{truth};
  comparison.run();
  return comparison.good() ? EXIT_SUCCESS : EXIT_FAILURE;
}
