#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// Results of calibrations.
namespace probebox::messages {

struct NamedValue {
  std::string key{};
  double value{};
  double sd{};
  bool has_sd{};
  static constexpr void fields(auto& self, auto&& field) {
    field("key", self.key, "name with the unit in it, such as tau_x_s");
    field("value", self.value, "in the unit of the name");
    field("sd", self.sd, "standard deviation (k = 1), the same unit");
    field("has_sd", self.has_sd, "0 when sd says nothing");
  }
};

struct ResultSummary {
  std::uint64_t id{};
  ResultState state{};
  std::string method{};
  std::string proposed_utc{};
  std::string accepted_utc{};
  std::string accepted_by{};
  std::string probe{};
  std::string machine{};
  std::string mounting{};
  std::vector<NamedValue> values{};
  double rms{};
  std::uint32_t dof{};
  double condition{};
  double chi2_reduced{};
  std::vector<std::string> warnings{};
  static constexpr void fields(auto& self, auto&& field) {
    field("id", self.id, "of the result, never used twice");
    field("state", self.state, "0 proposed, 1 accepted, 2 active, 3 retired");
    field("method", self.method, "such as delay-multi-speed");
    field("proposed_utc", self.proposed_utc, "ISO 8601");
    field("accepted_utc", self.accepted_utc, "ISO 8601, empty before");
    field("accepted_by", self.accepted_by, "who, empty before");
    field("probe", self.probe, "the probe that the result is bound to");
    field("machine", self.machine, "the machine that the result is bound to");
    field("mounting", self.mounting, "the mounting that the result is bound to");
    field("values", self.values, "what was found");
    field("rms", self.rms, "root mean square of the residuals, mm");
    field("dof", self.dof, "degrees of freedom");
    field("condition", self.condition, "condition number of the solved system");
    field("chi2_reduced", self.chi2_reduced, "near 1 when the residuals are as large as stated");
    field("warnings", self.warnings, "what a person should know before accepting");
  }
};

struct ListResults {
  static constexpr Operation kOperation = Operation::list_results;
  struct Request {
    std::uint64_t after_id{};
    static constexpr void fields(auto& self, auto&& field) {
      field("after_id", self.after_id, "only results with a higher id; 0 for all");
    }
  };
  struct Answer {
    std::vector<ResultSummary> results{};
    bool more{};
    static constexpr void fields(auto& self, auto&& field) {
      field("results", self.results, "by rising id, as many as one answer holds");
      field("more", self.more, "1 when there are more: ask again with the last id");
    }
  };
};

struct AcceptResult {
  static constexpr Operation kOperation = Operation::accept_result;
  struct Request {
    std::uint64_t id{};
    std::string by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("id", self.id, "of a proposed result");
      field("by", self.by, "who accepts it");
    }
  };
  using Answer = Nothing;
};

}  // namespace probebox::messages
