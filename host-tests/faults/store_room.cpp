#include "host-tests/faults/store_room.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "firmware/app/results/applied_correction_file.hpp"
#include "firmware/app/results/boot_counter.hpp"
#include "firmware/app/results/connection_inhibits.hpp"
#include "firmware/app/results/last_served_file.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "firmware/app/results/unit_record.hpp"
#include "firmware/store/store.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/faults/announcements.hpp"

namespace probebox::faults {
namespace {

using namespace std::chrono_literals;

constexpr const char* kLine = "modbus:/dev/ttyS0";
constexpr const char* kPerson = "person:Ada";
constexpr app::AppliedCorrectionFile::Limits kLimits{{{0.5, 0.05}, {0.5, 0.05}, {0.5, 0.05}}};

app::Mounting mounting() {
  app::Mounting here{.probe_serial_number = "1", .machine = "mill", .mounting = "spindle", .travel = {}};
  here.travel.fill({-500, 500});
  return here;
}

metrology::Result delayOf(double tau_s) {
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", tau_s, 4e-6)};
  return result;
}

std::string text(const Correction& value) {
  return std::to_string(value[0]) + " " + std::to_string(value[1]) + " " + std::to_string(value[2]);
}

class StoreRoom {
 public:
  StoreRoom(const std::filesystem::path& folder, const Say& say)
      : say_{say},
        store_{store::Store::openAnyhow((folder / "results.db").string())},
        results_{store_, mounting(), [this] { return now_; }, [](auto) { return std::optional<Error>{}; },
                 [](const Event&) {}},
        connections_{(folder / "connections").string(), [](bool) { return true; }},
        served_{(folder / "served-last").string()},
        boots_{app::countBoot((folder / "boots").string()).count},
        keeper_{(folder / "served").string(), kLimits, [this](const Event& bounds) { takeBounds(bounds); }},
        unit_{(folder / "unit").string()} {
    results_.setCutGuards([this] { return connections_.tryLockOutCuts(); });
    (void)results_.restore();
    if (const auto waiting = decided::inState(store_, store::State::accepted))
      for (const auto& record : *waiting) accepted_.push_back(record.id);
    before_ = served_.before().found_mm;
    for (const auto& event : keeper_.restore(now_, served_.before())) {
      if (const auto* applied = std::get_if<AppliedRestored>(&event)) applied_ = *applied;
      if (const auto* bounds = std::get_if<ServableWithin>(&event)) bounds_ = *bounds;
    }
    served_.setOnDisk(keeper_.startOnDisk(), keeper_.countOnDisk(), keeper_.appliedBefore());
    snapshot_.correction_mm = applied_.correction_mm;
    look();
    now_ += 2s;
  }

  void performAll() {
    say_(keeper_.problem().empty() ? "ready" : "unready");
    if (connections_.inhibits(kPerson)) inhibit(kPerson, false);
    serveAround({0.010, -0.005, 0.001});
    accept(propose(1e-3));
    serveAround({0.030, -0.005, 0.001});
    const auto second = propose(1.5e-3);
    inhibit(kLine, true);
    keepOrder(connections_.wordOrder(kLine) == 0 ? 1 : 0);
    accept(second);
    serveAround({0.031, 0.04, -0.001});
    accept(propose(2e-3));
    inhibit(kLine, false);
    look();
    rollBack();
    inhibit(kPerson, true);
    refuse();
    if (!unit_.locked()) provision("A1");
    serveAround({-0.02, 0.04, -0.03});
    keeper_.finish(snapshot_, served_.last());
  }

  void report() {
    const auto records = decided::newest(store_, 1000);
    if (!records) return say_("found notice " + records.error().what);
    for (const auto& record : *records)
      say_("found state " + std::to_string(record.id) + " " + std::string{store::name(record.state)});
    for (const auto& each : connections_.holders()) say_("found held " + each.connection);
    for (const auto* connection : {kLine, kPerson})
      if (const auto order = connections_.wordOrder(connection); order != 0)
        say_("found order " + std::string{connection} + " " + std::to_string(order));
    if (before_) say_("found before " + text(*before_));
    say_("found applied " + text(applied_.correction_mm) + " " + text(applied_.doubt_mm));
    if (unit_.inUse()) say_("found unit " + unit_.inUse()->serial_number);
    for (const auto& notice : {store_.notice(), store_.whyNotWritable(), keeper_.problem()})
      if (!notice.empty()) say_("found notice " + notice);
    for (const auto& damage : store_.damage()) say_("found notice " + damage);
    // One of two copies is what a cut leaves; the connections themselves are compared.
    if (unit_.locked() != unit_.inUse().has_value()) say_("found notice a unit that is half there");
    if (const auto problem = connections_.problem();
        !problem.empty() && problem.find("one of the two") == std::string::npos)
      say_("found notice " + problem);
  }

 private:
  template <class Done>
  void attempt(const std::string& what, const Done& done) {
    say_("doing " + what);
    const std::optional<std::string> failed = done();
    say_(failed ? "failed " + *failed : "done");
    if (failed) sayWhatIsThere();
    now_ += 2s;
  }
  void sayWhatIsThere() {
    std::string all = "sees";
    const auto records = decided::newest(store_, 1000);
    if (!records) return;
    for (const auto& record : *records)
      all += " " + std::to_string(record.id) + " " + std::string{store::name(record.state)};
    say_(all);
  }

  template <class Value>
  static std::optional<std::string> whyNot(const Value& outcome) {
    return outcome ? std::nullopt : std::optional{outcome.error().what};
  }

  store::Id nextId() {
    auto newest = decided::newest(store_, 1);
    if (!newest) newest = decided::newest(store_, 1);  // the reading itself may be the call that fails
    return newest && !newest->empty() ? newest->front().id + 1 : 1;
  }

  store::Id propose(double tau_s) {
    const auto id = nextId();
    attempt("propose " + std::to_string(id), [&] {
      return whyNot(
          store_.propose(results_.bindingFor("delay"), delayOf(tau_s), std::string(3000, 'x'), app::utcNow()));
    });
    return id;
  }

  void refuse() {
    attempt("refuse " + std::to_string(nextId()), [&] {
      return whyNot(
          store_.refuse(results_.bindingFor("delay"), "delay-multi-speed", {"noisy", "too"}, "{}", app::utcNow()));
    });
  }

  void accept(store::Id id) {
    look();
    const std::string what = connections_.anyInhibits() ? "await " : "accept ";
    accepted_.push_back(id);
    attempt(what + std::to_string(id), [&] { return whyNot(results_.accept(id, "Ada", true)); });
  }

  void rollBack() {
    look();
    attempt("back", [&] { return whyNot(results_.rollBack("delay", "Ada")); });
  }

  void inhibit(const char* connection, bool on) {
    attempt((on ? "hold " : "end ") + std::string{connection}, [&] {
      const auto failed = connections_.setInhibit(connection, on, "");
      return failed ? std::optional{failed->what} : std::nullopt;
    });
  }

  void provision(const std::string& serial_number) {
    attempt("unit " + serial_number, [&] {
      return whyNot(unit_.write("[unit]\nserial_number = \"" + serial_number +
                                    "\"\nvendor = \"V\"\nmodel = \"M\"\nboard = \"b\"\n[usb]\nvendor_id = "
                                    "1\nproduct_id = 2\n",
                                "b"));
    });
  }

  void keepOrder(std::uint16_t order) {
    attempt("order " + std::string{kLine} + " " + std::to_string(order), [&] {
      const auto failed = connections_.keepWordOrder(kLine, order);
      return failed ? std::optional{failed->what} : std::nullopt;
    });
  }

  // The state of the core as the worker sees it; a result that waits comes into force when it may.
  void look() {
    const auto waiting = std::ranges::find_if(accepted_, [&](store::Id id) { return results_.isWaiting(id); });
    const bool activates = waiting != accepted_.end() && !connections_.anyInhibits() && now_ >= MonoTime{} + 1s;
    const auto round = [&] {
      box::State state;
      state.at = now_;
      state.events = 1;
      state.snapshot.inhibited = connections_.anyInhibits();
      results_.look(state);
    };
    if (!activates) return round();
    attempt("activate " + std::to_string(*waiting), [&]() -> std::optional<std::string> {
      round();
      return results_.isWaiting(*waiting) ? std::optional<std::string>{"it still waits"} : std::nullopt;
    });
  }

  // A core that goes as far as it is told it may, at once, and a CNC that reads just then.
  void takeBounds(const Event& told) {
    bounds_ = std::get<ServableWithin>(told);
    serve(bounds_.greatest_mm);
    serve(bounds_.least_mm);
  }

  void serveAround(const Correction& wanted_mm) {
    snapshot_.valid = true;
    snapshot_.correction_mm = wanted_mm;
    for (std::size_t axis = 0; axis < wanted_mm.size(); ++axis)
      snapshot_.correction_mm[axis] = std::clamp(wanted_mm[axis], bounds_.least_mm[axis], bounds_.greatest_mm[axis]);
    serve(snapshot_.correction_mm);
    keeper_.look(published::Snapshot{snapshot_}, served_.last());
    now_ += 2s;
  }

  void serve(const Correction& value_mm) {
    snapshot_.at = now_ += 1ms;
    snapshot_.correction_mm = value_mm;
    for (auto& each_mm : snapshot_.correction_mm) each_mm = std::round(each_mm * 1e6) * 1e-6;
    say_("serving " + text(snapshot_.correction_mm));
    served_.note(snapshot_);
    say_("served " + text(snapshot_.correction_mm));
  }

  const Say& say_;
  MonoTime now_{};
  store::Store store_;
  app::ResultsInForce results_;
  std::vector<store::Id> accepted_;  // may wait
  app::ConnectionInhibits connections_;
  app::LastServedFile served_;
  std::uint16_t boots_;
  ServableWithin bounds_;
  published::Snapshot snapshot_;
  app::AppliedCorrectionFile keeper_;
  app::UnitRecord unit_;
  std::optional<Correction> before_;
  AppliedRestored applied_;
};

}  // namespace

void runStoreRoom(const std::filesystem::path& folder, const Say& say) {
  StoreRoom room{folder, say};
  room.performAll();
}

void reportStoreRoom(const std::filesystem::path& folder, const Say& say) {
  StoreRoom{folder, say}.report();
}

}  // namespace probebox::faults
