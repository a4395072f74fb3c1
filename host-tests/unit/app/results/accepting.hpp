#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <sqlite3.h>
#include <string>
#include <utility>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "firmware/corrections/tool_in_spindle.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/support/temporary_folder.hpp"

// A store and the results in force that tests accept results of, behind the first second in which none is.
namespace probebox::app {

inline const Mounting kMounting{"P-1001", "mill 3", "spindle"};

inline metrology::Result resultOf(const char* method, std::vector<metrology::Estimate> estimates) {
  metrology::Result result;
  result.method = method;
  result.estimates = std::move(estimates);
  return result;
}

// sd of each coordinate: 55 nm, so that 14 um are 180 combined ones.
inline metrology::Result centreAt(double x_mm, double y_mm, const char* method = "centreline") {
  return resultOf(method, {metrology::Estimate::vector("centre_mm", {x_mm, y_mm}, {5.5e-5, 5.5e-5})});
}

inline metrology::Result offsetOf(double x_mm, double y_mm, double sd_mm = 4e-5) {
  return resultOf("spindle-offset-2x2",
                  {metrology::Estimate::vector("offset_C_minus_A_mm", {0.1, 0.2}, {1e-5, 1e-5}),
                   metrology::Estimate::vector("stylus_offset_mm", {x_mm, y_mm}, {sd_mm, sd_mm})});
}

class Accepting : public testing::Test {
 protected:
  Accepting() {
    box::State state{};
    state.events = 1;
    results_.look(state);
    state.at = MonoTime{std::chrono::seconds{2}};
    results_.look(state);
  }

  void letCut(bool on) {
    box::State state{};
    state.events = 1;
    state.at = MonoTime{std::chrono::seconds{3}};
    state.snapshot.inhibited = on;
    results_.look(state);
  }

  store::Id propose(const std::string& subject, const metrology::Result& result, const store::Origin& origin = {}) {
    return store_.propose(results_.bindingFor(subject), result, "", "2026-01-01T00:00:00Z", origin).value();
  }
  Acceptance acceptedAs(const std::string& subject, const metrology::Result& result) {
    const auto accepted = results_.accept(propose(subject, result), "Ada");
    EXPECT_TRUE(accepted) << accepted.error().what;
    return accepted ? *accepted : Acceptance{};
  }
  store::Id proposeDelay(double tau_s) {
    return propose("delay", resultOf("delay-plates", {metrology::Estimate::scalar("tau_s", tau_s, 4e-6)}));
  }
  store::Id proposeLength(double length_mm = 120) {
    return propose(
        "assembly-4",
        resultOf("tool-assembly", {metrology::Estimate::scalar("gauge_length_mm", length_mm, std::optional{1e-3})}));
  }
  // The file of the store, by another program's hand.
  void changeStore(const std::string& sql) const {
    sqlite3* hand{};
    sqlite3_open(folder_.file("results.db").c_str(), &hand);
    EXPECT_EQ(sqlite3_exec(hand, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(hand);
    sqlite3_close(hand);
  }
  // From now on the store takes no change.
  void letStoreRefuse() const {
    changeStore("CREATE TRIGGER refuse BEFORE INSERT ON transitions BEGIN SELECT RAISE(ABORT, 'refused'); END");
  }
  void letStoreTakeChanges() const { changeStore("DROP TRIGGER refuse"); }

  std::optional<store::Record> inForce(const std::string& subject) {
    return decided::active(store_, results_.bindingFor(subject)).value();
  }
  // Of the centreline that the core holds now; nothing for none.
  std::optional<std::array<double, 2>> servedCentre() const {
    for (auto told = told_.rbegin(); told != told_.rend(); ++told) {
      const auto* centreline = std::get_if<CentrelineActivated>(&*told);
      if (centreline == nullptr) continue;
      return centreline->result_id == 0 ? std::nullopt : std::optional{centreline->centre_mm};
    }
    return std::nullopt;
  }

  // What a box that is started anew has in force.
  std::vector<std::uint64_t> afterRestart() {
    ResultsInForce anew{store_, kMounting, [] { return MonoTime{std::chrono::seconds{5}}; },
                        [](std::span<const Event>) { return std::optional<Error>{}; }, [](const Event&) {}};
    anew.restore();
    return anew.active();
  }

  support::TemporaryFolder folder_{support::inMemory()};
  store::Store store_ = store::Store::open(folder_.file("results.db")).value();
  std::vector<Event> told_;
  ResultsInForce results_{store_, kMounting, [] { return MonoTime{std::chrono::seconds{5}}; },
                          [](std::span<const Event>) { return std::optional<Error>{}; },
                          [this](const Event& event) { told_.push_back(event); }};
};

}  // namespace probebox::app
