#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// Lists, accepts and rolls back results of calibrations.
namespace probebox::messages {

struct NamedValue {
  std::string key{};
  double value{};
  double sd{};
  bool has_sd{};
  double u{};
  bool has_u{};
  static constexpr void fields(auto& self, auto&& field) {
    field("key", self.key, "name with the unit in it, such as tau_x_s");
    field("value", self.value, "in the unit of the name");
    field("sd", self.sd, "standard deviation (k = 1) of readings and of axes that stood still, the same unit");
    field("has_sd", self.has_sd, "0 when sd says nothing");
    field("u", self.u, "combined standard uncertainty (k = 1), type A and B, the same unit");
    field("has_u", self.has_u, "0 when u says nothing: sd counts");
  }
  // Standard uncertainty (k = 1) that a person reads after +/-: u, else sd; nothing if neither is known.
  std::optional<double> uncertainty() const {
    if (has_u) return u;
    return has_sd ? std::optional{sd} : std::nullopt;
  }
};

// A result that another one was computed with.
struct RestsOn {
  std::uint64_t id{};
  std::string subject{};
  bool retired{};
  static constexpr void fields(auto& self, auto&& field) {
    field("id", self.id, "of the result that it was computed with");
    field("subject", self.subject, "what that one is about, such as stylus-offset-1");
    field("retired", self.retired,
          "1 when that one is no longer in force, and what is differs by more than its u: repeat this one");
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
  std::string retired_utc{};
  std::string subject{};
  bool waiting_for_cut{};
  std::uint32_t first_value{};
  std::uint32_t value_count{};
  std::vector<RestsOn> rests_on{};
  std::string as_this_machine_by{};
  std::uint32_t about_count{};
  std::string why_not_in_force{};
  std::string rms_unit{};
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
    field("rms", self.rms, "root mean square of the residuals, in rms_unit");
    field("dof", self.dof, "degrees of freedom");
    field("condition", self.condition, "condition number of the solved system");
    field("chi2_reduced", self.chi2_reduced, "near 1 when the residuals are as large as stated");
    field("warnings", self.warnings, "what a person should know before accepting");
    field("retired_utc", self.retired_utc, "ISO 8601, empty unless it is retired");
    field("subject", self.subject, "what the result is about, such as delay or screw-x");
    field("waiting_for_cut", self.waiting_for_cut, "1 when it is accepted and comes into force at the end of the cut");
    field("first_value", self.first_value, "how many of its values come before those here");
    field("value_count", self.value_count, "of all its values; where there are more than came, ask again for the rest");
    field("rests_on", self.rests_on, "results that it was computed with");
    field("as_this_machine_by", self.as_this_machine_by,
          "who said that its case, which does not name probe, machine and mounting, was measured here");
    field("about_count", self.about_count,
          "so many of its values, the first, are about the subject; the same readings gave the others");
    field("why_not_in_force", self.why_not_in_force,
          "why this box, as it is described now, cannot have it in force, whatever its state; empty where it can, and "
          "for one that is retired");
    field("rms_unit", self.rms_unit, "unit of rms: mm, um, rad");
  }
};

struct ListResults {
  static constexpr Operation kOperation = Operation::list_results;
  struct Request {
    std::uint64_t after_id{};
    std::uint32_t first_value{};
    std::uint32_t newest{};
    static constexpr void fields(auto& self, auto&& field) {
      field("after_id", self.after_id, "only results with a higher id; 0 for all");
      field("first_value", self.first_value,
            "of the first of these results the values from this one on, counted from 0");
      field("newest", self.newest, "of these results only the newest so many; 0 for all");
    }
  };
  struct Answer {
    std::vector<ResultSummary> results{};
    bool more{};
    static constexpr void fields(auto& self, auto&& field) {
      field("results", self.results, "by rising id, as many as one answer holds");
      field("more", self.more,
            "1 when there are more: ask again with the last id, or one below it where its values are not all there");
    }
  };
};

// One value of a result beside that of the result in force about the same subject.
struct ValueChange {
  std::string key{};
  double value{};
  double sd{};
  bool has_sd{};
  double before{};
  double sd_before{};
  bool has_sd_before{};
  double in_sd{};
  bool has_in_sd{};
  static constexpr void fields(auto& self, auto&& field) {
    field("key", self.key, "name with the unit in it, such as centre_mm[0]");
    field("value", self.value, "of the result to accept, in the unit of the name");
    field("sd", self.sd, "its standard deviation (k = 1)");
    field("has_sd", self.has_sd, "0 when sd says nothing");
    field("before", self.before, "of the result in force");
    field("sd_before", self.sd_before, "its standard deviation (k = 1)");
    field("has_sd_before", self.has_sd_before, "0 when sd_before says nothing");
    field("in_sd", self.in_sd, "absolute difference in units of the combined standard deviation of both");
    field("has_in_sd", self.has_in_sd, "0 when neither has a standard deviation");
  }
};

// Reads one stored result or refusal with all values, and its dataset where it is kept, piece by piece.
struct GetResult {
  static constexpr Operation kOperation = Operation::get_result;
  struct Request {
    std::uint64_t id{};
    ResultDocument document{};
    std::uint64_t offset{};
    static constexpr void fields(auto& self, auto&& field) {
      field("id", self.id, "of the result or of the refusal");
      field("document", self.document, "0 the result or the refusal, 1 the dataset that it was solved from");
      field("offset", self.offset, "bytes that the host already has");
    }
  };
  struct Answer {
    ResultSummary summary{};
    bool dataset_kept{};
    std::uint64_t total_bytes{};
    std::uint64_t offset{};
    std::string bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("summary", self.summary, "with offset 0, without values and warnings: the document has them");
      field("dataset_kept", self.dataset_kept, "1 when the box keeps its dataset");
      field("total_bytes", self.total_bytes, "of the whole document; 0 for a dataset that is not kept");
      field("offset", self.offset, "where this piece begins");
      field("bytes", self.bytes, "a piece of the document, JSON text");
    }
  };
};

struct AcceptResult {
  static constexpr Operation kOperation = Operation::accept_result;
  struct Request {
    std::uint64_t id{};
    std::string by{};
    bool although_it_differs{};
    bool compare_only{};
    static constexpr void fields(auto& self, auto&& field) {
      field("id", self.id, "of a proposed result");
      field("by", self.by, "who accepts it; may be empty with compare_only");
      field("although_it_differs", self.although_it_differs,
            "1: accept it even where a value is more than 4 sd from the result in force");
      field("compare_only", self.compare_only, "1: change nothing and answer what accepting it would answer");
    }
  };
  struct Answer {
    ResultState state{};
    bool waiting_for_cut{};
    std::string subject{};
    bool first_of_subject{};
    std::uint64_t compared_with{};
    std::vector<ValueChange> changes{};
    bool differs{};
    std::vector<std::string> notes{};
    std::string accepted_by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("state", self.state, "2 active: in force now; 1 accepted: not yet");
      field("waiting_for_cut", self.waiting_for_cut, "1 when it comes into force by itself at the end of the cut");
      field("subject", self.subject, "what it is about");
      field("first_of_subject", self.first_of_subject, "1 when none about the subject was in force");
      field("compared_with", self.compared_with, "the result that was in force about the subject; 0 for none");
      field("changes", self.changes, "value by value against that one");
      field("differs", self.differs,
            "1 when a value differs by more than 4 sd, the two cannot be compared, or it fails a limit");
      field("notes", self.notes, "what a person should know about the effect");
      field("accepted_by", self.accepted_by,
            "who accepted it, which may have been before this request; empty of one that nobody has");
    }
  };
};

// Goes back to the result that was in force before.
struct RollbackResult {
  static constexpr Operation kOperation = Operation::rollback_result;
  struct Request {
    std::uint64_t id{};
    std::string subject{};
    std::string by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("id", self.id, "of the result to go back from, active or waiting; 0: the subject says which");
      field("subject", self.subject, "such as delay, or a method that answers it, such as delay-multi-speed");
      field("by", self.by, "who goes back");
    }
  };
  struct Answer {
    std::string subject{};
    std::uint64_t retired_id{};
    std::uint64_t active_id{};
    bool withdrawn{};
    std::vector<std::string> notes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("subject", self.subject, "what was asked about");
      field("retired_id", self.retired_id, "the result that is retired now; 0 for none");
      field("active_id", self.active_id, "the result that came back into force; 0: none about the subject is in force");
      field("withdrawn", self.withdrawn, "1 when the retired result only waited: nothing in force has changed");
      field("notes", self.notes, "what a person should know about the effect");
    }
  };
};

// One change of a result's state.
struct ResultTransition {
  std::uint64_t number{};
  std::uint64_t result_id{};
  std::string method{};
  std::string subject{};
  std::string probe{};
  std::string machine{};
  std::string mounting{};
  ResultState state{};
  std::string utc{};
  std::string by{};
  std::string remark{};
  static constexpr void fields(auto& self, auto&& field) {
    field("number", self.number, "rises with time, over all results");
    field("result_id", self.result_id, "whose state changed");
    field("method", self.method, "such as delay-multi-speed");
    field("subject", self.subject, "what the result is about");
    field("probe", self.probe, "the probe that the result is bound to");
    field("machine", self.machine, "the machine that the result is bound to");
    field("mounting", self.mounting, "the mounting that the result is bound to");
    field("state", self.state, "the state that it came into: 0 proposed, 1 accepted, 2 active, 3 retired, 4 refused");
    field("utc", self.utc, "ISO 8601");
    field("by", self.by, "who; empty for the box itself");
    field("remark", self.remark, "what was said with it, such as that it was accepted although it differs; or empty");
  }
};

// What happened to results, and who did it.
struct ResultHistory {
  static constexpr Operation kOperation = Operation::result_history;
  struct Request {
    std::uint64_t id{};
    std::string subject{};
    std::uint64_t after_number{};
    static constexpr void fields(auto& self, auto&& field) {
      field("id", self.id, "of one result; 0 for all");
      field("subject", self.subject, "or a method that answers it; empty for all");
      field("after_number", self.after_number, "only later than this transition; 0 from the beginning");
    }
  };
  struct Answer {
    std::vector<ResultTransition> transitions{};
    bool more{};
    static constexpr void fields(auto& self, auto&& field) {
      field("transitions", self.transitions, "in the order in which they happened, as many as one answer holds");
      field("more", self.more, "1 when there are more: ask again with the last number");
    }
  };
};

// Declares that a cut is on or over. Each connection has an inhibit of its own, which survives restarts.
struct SetInhibit {
  static constexpr Operation kOperation = Operation::set_inhibit;
  struct Request {
    bool active{};
    std::string by{};
    std::string connection{};
    static constexpr void fields(auto& self, auto&& field) {
      field("active", self.active, "1 while a cut is on: no result comes into force; 0 when it is over");
      field("by", self.by, "the person whose inhibit it is; empty: the link's own");
      field("connection", self.connection,
            "with active 0: clears the inhibit of that connection, as status names it, in the name of `by`; empty: "
            "one's own");
    }
  };
  using Answer = Nothing;
};

}  // namespace probebox::messages
