#include "firmware/front_end/rp2040/latching.hpp"

#include <array>

#include "firmware/front_end/rp2040/pio_programs.hpp"
#include "firmware/front_end/rp2040/registers.hpp"

namespace probebox::front_end {
namespace {

using Counts = std::array<std::uint32_t, kCounters>;

// DMA channels. 0 to 3 keep the newest count of each counter in kNewest.
//   sample: the pacer pushes the address of kNewest; kSampleStart passes it on to kSampleCopy, which so begins to copy.
//   index: a stamp goes to its ring, then kIndexAddress starts kIndexCopy in the same way, and that one kIndexStamp.
enum Channel : unsigned {
  kSampleStart = 4,
  kSampleCopy,
  kIndexStamp,
  kIndexAddress,
  kIndexCopy,
  kLineStamp,
  kChannels
};
constexpr std::uint32_t kForLong = 0xFFFF'FFFF;

enum Machine : unsigned { kLineStamper, kIndexStamper, kSamplePacer, kSyncOutPacer };

// Rings of DMA begin at a multiple of their size.
constexpr std::size_t kSampleRing = 64, kIndexRing = 1024, kLineRing = 4096;
// More in a pass are noise: that many cannot be handled in time.
constexpr std::uint32_t kMostChanges = 128;
alignas(sizeof(Counts)) Counts newest;
alignas(kSampleRing * sizeof(Counts)) std::array<Counts, kSampleRing> sample_ring;
alignas(kIndexRing * sizeof(Counts)) std::array<Counts, kIndexRing> index_ring;
alignas(kIndexRing * 4) std::array<std::uint32_t, kIndexRing> index_stamps;
alignas(kLineRing * 4) std::array<std::uint32_t, kLineRing> line_stamps;
std::uint32_t newest_address;

constexpr unsigned bitsOf(std::size_t bytes) {
  unsigned bits = 0;
  while ((std::size_t{1} << bits) < bytes) ++bits;
  return bits;
}
template <class T>
std::uint32_t addressOf(const T& object) {
  return reinterpret_cast<std::uint32_t>(&object);
}
// What the DMA has written is not known to the compiler.
template <class T>
T volatileCopy(const T& from) {
  T copy;
  const auto* const words = reinterpret_cast<const volatile std::uint32_t*>(&from);
  for (std::size_t i = 0; i < sizeof(T) / 4; ++i) reinterpret_cast<std::uint32_t*>(&copy)[i] = words[i];
  return copy;
}

// A machine that runs `top` to `last` with inputs from `in_pin` and one output.
struct Setup {
  std::uint32_t pio;
  unsigned machine, top, last, in_pin, out_pin;

  std::uint32_t base() const { return pio + pio::machine(machine); }
  void execute(std::uint32_t code) const { at(base() + pio::kExecute) = code; }
  // Loads a value into osr.
  void load(std::uint32_t value) const {
    at(pio + pio::kTx + 4 * machine) = value;
    execute(pio_code::kPull);
  }
  void prepare() const {
    constexpr std::uint32_t kShiftOutRight = 1U << 19U, kJoinRx = 1U << 31U, kSetOne = 1U << 26U;
    at(base() + pio::kDivider) = 1U << 16U;
    at(base() + pio::kExecControl) = last << 12U | top << 7U;
    // Joining the queues, and parting them, empties both.
    at(base() + pio::kShiftControl) = kShiftOutRight | kJoinRx;
    at(base() + pio::kShiftControl) = kShiftOutRight;
    at(base() + pio::kPins) = kSetOne | in_pin << 15U | out_pin << 5U;
    execute(pio_code::set(pio_code::Place::y, 0));
    execute(pio_code::move(pio_code::Place::isr, pio_code::Place::null));
    execute(pio_code::jump(top));
  }
  // The queue of what it pushes is twice as deep then, and it can be loaded no more.
  void deepen() const { at(base() + pio::kShiftControl) = 1U << 19U | 1U << 31U; }
  void drive() const {
    execute(pio_code::set(pio_code::Place::pins, 0));
    execute(pio_code::set(pio_code::Place::pin_directions, 1));
  }
};

template <class Program>
void loadProgram(std::uint32_t pio, unsigned at_place, const Program& program) {
  for (const auto code : program) at(pio + pio::kMemory + 4 * at_place++) = code;
}

void prepareChannel(unsigned channel, std::uint32_t from, std::uint32_t to, std::uint32_t count,
                    std::uint32_t control) {
  at(dma::readAddress(channel)) = from;
  at(dma::writeAddress(channel)) = to;
  at(dma::count(channel)) = count;
  at(dma::control(channel)) = control | dma::kWord | dma::kEnable | dma::kQuiet;
}

void prepareChannels() {
  using namespace dma;
  const auto alone = [](unsigned channel) { return chainTo(channel); };
  for (unsigned k = 0; k < kCounters; ++k)
    prepareChannel(k, pio::k0 + pio::kRx + 4 * k, addressOf(newest[k]), kForLong, pacedBy(kPio0Rx0 + k) | alone(k));
  prepareChannel(kSampleStart, pio::k1 + pio::kRx + 4 * kSamplePacer, readAddressTrigger(kSampleCopy), kForLong,
                 pacedBy(kPio1Rx0 + kSamplePacer) | alone(kSampleStart));
  constexpr std::uint32_t kCopy = pacedBy(kUnpaced) | kIncrementRead | kIncrementWrite | kRingOnWrite;
  prepareChannel(kSampleCopy, 0, addressOf(sample_ring), kCounters,
                 kCopy | ringBits(bitsOf(sizeof sample_ring)) | alone(kSampleCopy));
  prepareChannel(kIndexStamp, pio::k1 + pio::kRx + 4 * kIndexStamper, addressOf(index_stamps), 1,
                 pacedBy(kPio1Rx0 + kIndexStamper) | kIncrementWrite | kRingOnWrite |
                     ringBits(bitsOf(sizeof index_stamps)) | chainTo(kIndexAddress));
  prepareChannel(kIndexAddress, addressOf(newest_address), readAddressTrigger(kIndexCopy), 1,
                 pacedBy(kUnpaced) | alone(kIndexAddress));
  prepareChannel(kIndexCopy, 0, addressOf(index_ring), kCounters,
                 kCopy | ringBits(bitsOf(sizeof index_ring)) | chainTo(kIndexStamp));
  prepareChannel(kLineStamp, pio::k1 + pio::kRx + 4 * kLineStamper, addressOf(line_stamps), kForLong,
                 pacedBy(kPio1Rx0 + kLineStamper) | kIncrementWrite | kRingOnWrite |
                     ringBits(bitsOf(sizeof line_stamps)) | alone(kLineStamp));
  at(kTrigger) = 0xFU | 1U << kSampleStart | 1U << kIndexStamp | 1U << kLineStamp;
}

std::uint32_t placeIn(Channel channel, std::uint32_t ring, std::size_t entry_bytes) {
  return static_cast<std::uint32_t>((at(dma::writeAddress(channel)) - ring) / entry_bytes);
}

}  // namespace

void Latching::stop() {
  at(pio::k0 + pio::kControl) = 0;
  at(pio::k1 + pio::kControl) = 0;
  at(dma::kAbort) = (1U << kChannels) - 1;
  for (int tries = 1000; tries > 0 && at(dma::kAbort) != 0; --tries) {
  }
}

void Latching::start(const Settings& settings) {
  newest = {};
  newest_address = addressOf(newest);
  samples_ = lines_ = indexes_ = 0;
  loadProgram(pio::k0, 0, quadrature::kProgram);
  for (unsigned k = 0; k < kCounters; ++k) {
    const Setup counter{pio::k0, k, quadrature::kTop, quadrature::kLast, kFirstEncoderPin + 2 * k, 0};
    counter.prepare();
    counter.execute(pio_code::move(pio_code::Place::osr, pio_code::Place::pins));  // the state to begin with
    counter.deepen();
  }
  loadProgram(pio::k1, 0, stamper::kProgram);
  loadProgram(pio::k1, pacer::kTop, pacer::kProgram);
  for (const auto& [machine, pin] :
       {std::pair{kLineStamper, kFirstLinePin}, std::pair{kIndexStamper, kFirstIndexPin}}) {
    const Setup stamps{pio::k1, machine, stamper::kTop, stamper::kLast, pin, 0};
    stamps.prepare();
    stamps.deepen();
  }
  const Setup sample{pio::k1, kSamplePacer, pacer::kTop, pacer::kLast, 0, kConvertPin};
  sample.prepare();
  sample.load(newest_address);
  sample.execute(pio_code::move(pio_code::Place::y, pio_code::Place::osr));
  sample.load(pacer::reloadOf(settings.steps_a_sample));
  sample.drive();
  const Setup sync{pio::k1, kSyncOutPacer, pacer::kTop, pacer::kLast, 0, kSyncOutPin};
  sync.prepare();
  sync.load(pacer::reloadOf(settings.sync_out_steps == 0 ? kMostSyncOutSteps : settings.sync_out_steps));
  sync.drive();
  prepareChannels();
  at(pio::k0 + pio::kIrq) = 0xF;
  at(pio::k0 + pio::kFifoDebug) = 0xF;
  at(pio::k1 + pio::kFifoDebug) = 0xF;
  at(pio::k0 + pio::kControl) = 0xF;
  // At once: the counters of all are one.
  at(pio::k1 + pio::kControl) = settings.sync_out_steps == 0 ? 0x7 : 0xF;
}

void Latching::tellChanges(Assembly& assembly) {
  tellLines(assembly);
  tellIndex(assembly);
  keepRunning();
}

void Latching::tellLines(Assembly& assembly) {
  const auto end = placeIn(kLineStamp, addressOf(line_stamps), sizeof line_stamps[0]);
  const bool stalled = (at(pio::k1 + pio::kFifoDebug) & 1U << kLineStamper) != 0;
  if (stalled) at(pio::k1 + pio::kFifoDebug) = 1U << kLineStamper;
  if (stalled || (end - lines_) % kLineRing > kMostChanges) {
    lines_ = end;
    return assembly.edgesLost(volatileCopy(line_stamps[(end + kLineRing - 1) % kLineRing]));
  }
  for (; lines_ != end; lines_ = (lines_ + 1) % kLineRing) assembly.lines(volatileCopy(line_stamps[lines_]));
}

void Latching::tellIndex(Assembly& assembly) {
  const auto end = placeIn(kIndexCopy, addressOf(index_ring), sizeof index_ring[0]);
  const bool stalled = (at(pio::k1 + pio::kFifoDebug) & 1U << kIndexStamper) != 0;
  if (stalled) at(pio::k1 + pio::kFifoDebug) = 1U << kIndexStamper;
  if (stalled || (end - indexes_) % kIndexRing > kMostChanges) {
    indexes_ = end;
    return assembly.latchesLost();
  }
  for (; indexes_ != end; indexes_ = (indexes_ + 1) % kIndexRing)
    assembly.index(volatileCopy(index_stamps[indexes_]), volatileCopy(index_ring[indexes_]));
}

// A channel ends after 2^32 transfers.
void Latching::keepRunning() {
  for (const unsigned channel : {0U, 1U, 2U, 3U, unsigned{kSampleStart}, unsigned{kLineStamp}})
    if ((at(dma::control(channel)) & dma::kBusy) == 0) at(dma::kTrigger) = 1U << channel;
}

bool Latching::hasNext() const {
  return samples_ != placeIn(kSampleCopy, addressOf(sample_ring), sizeof sample_ring[0]);
}

void Latching::next(Latched& latched) {
  latched.counts = volatileCopy(sample_ring[samples_]);
  samples_ = (samples_ + 1) % kSampleRing;
  // A count that did not fit into the queue is lost until the next one: a fault, as an illegal transition.
  const std::uint32_t illegal = at(pio::k0 + pio::kIrq) & 0xFU;
  const std::uint32_t stalled = at(pio::k0 + pio::kFifoDebug) & 0xFU;
  at(pio::k0 + pio::kIrq) = illegal;
  if (stalled != 0) at(pio::k0 + pio::kFifoDebug) = stalled;
  latched.illegal = static_cast<std::uint8_t>(illegal | stalled);
  const std::uint32_t levels = at(sio::kIn);
  for (unsigned k = 0; k < kCounters; ++k)
    latched.broken = static_cast<std::uint8_t>(latched.broken | (levels >> kWirePins[k] & 1U) << k);
}

}  // namespace probebox::front_end
