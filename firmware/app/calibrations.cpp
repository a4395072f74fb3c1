#include "firmware/app/calibrations.hpp"

#include <array>
#include <chrono>
#include <ctime>
#include <thread>
#include <utility>

#include "firmware/app/log.hpp"
#include "firmware/store/dataset_json.hpp"

namespace probebox::app {
namespace {

std::string utcNow() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text.data();
}

// What a result says about the delay of each axis; nothing when it is about something else.
std::optional<DelayActivated> delayOf(const store::Record& record, MonoTime now) {
  const metrology::Result* result = record.result();
  if (result == nullptr) return std::nullopt;
  const metrology::Estimate* tau = result->find("tau_s");
  if (tau == nullptr || tau->values.empty()) return std::nullopt;
  DelayActivated delay{.result_id = record.id, .tau_s = {}, .sd_s = {}, .at = now};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const std::size_t i = tau->values.size() == kLinearAxes ? axis : 0;
    delay.tau_s[axis] = tau->values[i];
    delay.sd_s[axis] = i < tau->sd.size() ? tau->sd[i] : 0.0;
  }
  return delay;
}

}  // namespace

Calibrations::Calibrations(store::Store store, Mounting mounting, procedure::Facts facts,
                           std::function<MonoTime()> now, TellCore tell_core)
    : store_{std::move(store)},
      mounting_{std::move(mounting)},
      facts_{facts},
      now_{std::move(now)},
      tell_core_{std::move(tell_core)} {}

store::Binding Calibrations::bindingFor(const std::string& method) const {
  return {.method = method,
          .probe_serial_number = mounting_.probe_serial_number,
          .machine = mounting_.machine,
          .mounting = mounting_.mounting};
}

std::optional<DelayActivated> Calibrations::restore() {
  for (const auto method : metrology::methods()) {
    const auto active = store_.active(bindingFor(std::string{method}));
    if (!active) {
      logError("The results in force could not be read: " + active.error().what);
      continue;
    }
    if (!*active) continue;
    if (const auto delay = delayOf(**active, now_())) {
      const std::lock_guard lock{mutex_};
      active_results_ = {(*active)->id};
      return delay;
    }
  }
  return std::nullopt;
}

void Calibrations::solve(std::uint32_t run, procedure::Method method, const capture::Recording& recording,
                         const capture::Scales& scales) {
  const auto [dataset, refusal] = procedure::runDataset(method, recording, scales, facts_);
  dataset_run_ = run;
  dataset_ = store::toJson(dataset);
  const metrology::Solved solved = refusal ? metrology::Solved{*refusal} : metrology::solve(dataset);
  setRefusal(solved ? "" : solved.error().name + ": " + solved.error().reason);
  const auto id = keep(bindingFor(dataset.method), solved);
  insist(Solved{.run = run, .refused = !solved || !id, .result_id = id.value_or(0), .at = now_()});
}

std::optional<store::Id> Calibrations::keep(const store::Binding& binding, const metrology::Solved& solved) {
  const auto id = solved ? store_.propose(binding, *solved, dataset_, utcNow())
                         : store_.refuse(binding, solved.error(), dataset_, utcNow());
  if (id) return *id;
  logError("A calibration could not be stored: " + id.error().what);
  if (solved) setRefusal("not-stored: The calibration succeeded and could not be stored: " + id.error().what);
  return std::nullopt;
}

Outcome<store::Record, store::Failure> Calibrations::accept(std::uint64_t id, const std::string& by) {
  const auto found = store_.find(id);
  if (!found) return found.error();
  const auto& binding = found->binding;
  if (binding != bindingFor(binding.method)) {
    return store::Failure{
        store::Reason::not_possible_now,
        "Result " + std::to_string(id) + " is for probe " + binding.probe_serial_number + " in " + binding.mounting +
            " of " + binding.machine +
            ", which is not what this box describes now: " + "change the descriptions, or calibrate again."};
  }
  auto accepted = store_.accept(id, by, utcNow());
  if (!accepted) return accepted;
  if (const auto delay = delayOf(*accepted, now_())) {
    {
      const std::lock_guard lock{mutex_};
      active_results_ = {accepted->id};
    }
    insist(*delay);
  }
  return accepted;
}

const std::string& Calibrations::dataset(std::uint32_t run) const {
  static const std::string none;
  return run != 0 && run == dataset_run_ ? dataset_ : none;
}

std::string Calibrations::lastRefusal() const {
  const std::lock_guard lock{mutex_};
  return last_refusal_;
}

std::vector<std::uint64_t> Calibrations::activeResults() const {
  const std::lock_guard lock{mutex_};
  return active_results_;
}

void Calibrations::setRefusal(const std::string& text) {
  const std::lock_guard lock{mutex_};
  last_refusal_ = text;
}

// The core empties its queue within milliseconds; the worker may wait, and a lost answer would block the procedure for
// ever.
void Calibrations::insist(const Event& command) {
  while (!tell_core_(command)) std::this_thread::sleep_for(std::chrono::milliseconds{1});
}

}  // namespace probebox::app
