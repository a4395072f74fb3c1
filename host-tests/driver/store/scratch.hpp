#pragma once
#include <filesystem>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <string>

#include "firmware/store/store.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::store {

class Scratch {
 public:
  const std::filesystem::path& directory() const { return folder_.path(); }
  std::string file() const { return folder_.file("results.db"); }
  // By another program's hand.
  void change(const std::string& sql, const std::string& other = {}) const {
    sqlite3* hand{};
    sqlite3_open((other.empty() ? file() : other).c_str(), &hand);
    EXPECT_EQ(sqlite3_exec(hand, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(hand);
    sqlite3_close(hand);
  }

 private:
  support::TemporaryFolder folder_;
};

inline const Binding kBinding{"delay", "P-1001", "mill 3", "spindle"};

inline metrology::Result delayOf(double tau_s) {
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", tau_s, 4.1e-6)};
  result.also = {metrology::Estimate::matrix("gain", 3, {1, 0, 0, 0, 1, 0, 0, 0, 1.0 / 3}, {}),
                 metrology::Estimate::vector("centre_mm", {0.1, -20.3, 1e-17}, {1e-3, 1e-3, 2e-3})};
  result.rms = 0.1 + 0.2;
  result.dof = 17;
  result.condition = 3.5;
  result.chi2_reduced = 1.07;
  result.covariance = {{"tau_s"}, {1.681e-11}};
  result.convention = "tau = machine delay - probe delay";
  result.warnings = {"only two speeds: \"5\" and 40 mm/s"};
  result.dropped = {{"touch 7", "residual 5.1 sd"}};
  result.design_per = "one touch, mm";
  result.unobservable = {"tau_machine and tau_probe by themselves"};
  result.budget = {{"readings", false, {2e-6}}, {"sd_effective_diameter_mm", true, {1e-5}}};
  result.conditions = {{"probe", "P-7"}};
  return result;
}

}  // namespace probebox::store
