#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/gpio/lines.hpp"
#include "drivers/io/encoder_axis.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::gpio {

// Line numbers of A and B in the edges of a quadrature encoder.
enum class Phase : std::uint8_t { a = 0, b = 1 };

// Counts the transitions of A and B: four per period, up while A leads B. Pure.
class QuadratureDecoder {
 public:
  enum class Heard : std::uint8_t {
    level,    // the present level, after the lines were requested: no transition
    counted,  // a step up or down
    broken,   // a transition was missed: the count does not continue the last one
  };

  // edge.line: a Phase. A missed edge shows as a gap in the sequence, or as an edge to the level the line already had.
  Heard push(const Edge& edge);
  // Forgets the levels: the lines were lost.
  void restart() { known_ = {}; }

  bool knowsLevels() const { return known_[0] && known_[1]; }
  std::int64_t count() const { return count_; }
  std::uint64_t illegal() const { return illegal_; }  // transitions that no encoder makes
  std::uint64_t missed() const { return missed_; }    // edges, by the kernel's sequence

 private:
  std::array<bool, 2> high_{};
  std::array<bool, 2> known_{};
  std::array<std::uint32_t, 2> sequence_{};
  std::int64_t count_{};
  std::uint64_t illegal_{};
  std::uint64_t missed_{};
};

struct QuadratureConfig {
  std::size_t axis{};  // place in X Y Z A B C
  Nanoseconds interval{};
  double maximum_edge_rate_hz{};
};

// Puts the two lines of an encoder into one request, because the kernel keeps the order of edges only within a request.
ChipLines quadratureLines(const board::GpioLine& a, const board::GpioLine& b);

// Delivers the counts of one axis at equal intervals from the edges of its lines A and B. Edges are stamped, so each
// count is exact for its stamp; an edge that arrives more than kPatience late counts from its arrival on. Delivers
// SourceLost when transitions were missed, when edges exceed the allowed rate (counts then stop until the rate is below
// 0.8 times the limit), and when the lines are gone.
class QuadratureSource final : public io::EventSource {
 public:
  // An edge that the kernel delivers later than this after its stamp is late.
  static constexpr Nanoseconds kPatience = std::chrono::milliseconds{2};
  // Number of latest edges that define the rate.
  static constexpr std::size_t kRateEdges = 64;

  // edges: source of the lines of quadratureLines().
  QuadratureSource(std::unique_ptr<io::EventSource> edges, const QuadratureConfig& config);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return edges_->descriptor(); }
  std::string_view name() const override { return name_; }
  std::string_view problem() const override;
  // Illegal transitions, and edges that came late.
  std::uint64_t unusable() const override { return decoder_.illegal() + late_edges_ + edges_->unusable(); }

  const QuadratureDecoder& decoder() const { return decoder_; }

 private:
  static constexpr std::size_t kBatch = 64;

  bool refill(MonoTime now);
  std::size_t giveUntil(MonoTime end, std::span<Event> into);
  void take(const Event& event);
  void take(const Edge& edge);
  void judgeRate(MonoTime at);
  bool isFasterThan(double rate_hz, MonoTime now) const;
  void lose(LossReason reason, std::uint64_t events, MonoTime at);

  std::unique_ptr<io::EventSource> edges_;
  QuadratureConfig config_;
  io::EncoderAxis axis_;
  std::string name_;
  std::string too_fast_;
  QuadratureDecoder decoder_;
  std::array<Event, kBatch> batch_{};
  std::size_t batch_size_{}, batch_taken_{};
  std::array<MonoTime, kRateEdges> latest_{};
  std::uint64_t edges_seen_{};
  bool refused_{};
  bool has_next_{};
  MonoTime next_at_{};  // of the next count
  std::uint32_t sequence_{};
  bool loss_unreported_{};
  SourceLost loss_{};
  std::uint64_t late_edges_{};
};

}  // namespace probebox::gpio
