#pragma once
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/run_dataset.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// What a calibration belongs to.
struct Mounting {
  std::string probe_serial_number;
  std::string machine;
  std::string mounting;
};

// Solves recorded runs, keeps the results and brings accepted ones into force. Lives on the worker's thread, except for
// lastRefusal() and activeResults(), which any thread may ask.
class Calibrations {
 public:
  // `tell_core` hands a command to the core; false when its queue is full.
  using TellCore = std::function<bool(const Event&)>;
  Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
               TellCore tell_core);

  // The result in force from earlier runs of the daemon, if there is one.
  std::optional<DelayActivated> restore();

  void solve(std::uint32_t run, procedure::Method method, const capture::Recording& recording,
             const capture::Scales& scales);
  Outcome<store::Record, store::Failure> accept(std::uint64_t id, const std::string& by);
  Outcome<std::vector<store::Record>, store::Failure> newest(std::size_t count) { return store_.newest(count); }
  // The data of a run of this process, as JSON text; empty when there is none.
  const std::string& dataset(std::uint32_t run) const;

  std::string lastRefusal() const;
  std::vector<std::uint64_t> activeResults() const;

 private:
  store::Binding bindingFor(const std::string& method) const;
  std::optional<store::Id> keep(const store::Binding& binding, const metrology::Solved& solved);
  void setRefusal(const std::string& text);
  void insist(const Event& command);

  store::Store store_;
  Mounting mounting_;
  procedure::Facts facts_;
  std::function<MonoTime()> now_;
  TellCore tell_core_;
  std::uint32_t dataset_run_{};
  std::string dataset_;
  mutable std::mutex mutex_;
  std::string last_refusal_;
  std::vector<std::uint64_t> active_results_;
};

}  // namespace probebox::app
