#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// Proposes cases that were measured without the box.
namespace probebox::messages {

// One entry of a case's configuration.
struct CaseEntry {
  std::string key{};
  CaseValue kind{};
  std::vector<double> numbers{};
  std::uint16_t columns{};
  std::string text{};
  static constexpr void fields(auto& self, auto&& field) {
    field("key", self.key, "such as sigma_mm");
    field("kind", self.kind, "0 yes or no (number 1 or 0), 1 number, 2 text, 3 numbers, 4 matrix");
    field("numbers", self.numbers, "of a matrix row by row");
    field("columns", self.columns, "of a matrix");
    field("text", self.text, "of a text");
  }
};

// Rows of one column of a case's table.
struct CaseColumn {
  std::string table{};
  std::string column{};
  std::vector<double> values{};
  static constexpr void fields(auto& self, auto&& field) {
    field("table", self.table, "such as readings");
    field("column", self.column, "name with the unit in it");
    field("values", self.values, "go on where the values of this column ended that came before");
  }
};

// A case that was measured without the box: it solves the case and keeps the result as proposed.
struct ProposeCase {
  static constexpr Operation kOperation = Operation::propose_case;
  struct Request {
    std::uint32_t number{};
    bool first{};
    bool last{};
    std::string method{};
    std::vector<CaseEntry> config{};
    std::vector<CaseColumn> columns{};
    bool follow{};
    bool as_this_machine{};
    std::string by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("number", self.number, "chosen by the host, the same for all pieces of a case");
      field("first", self.first, "1 with the first piece");
      field("last", self.last, "1 with the last piece: solve it now");
      field("method", self.method, "such as swivel-error; counts in the first piece");
      field("config", self.config, "entries of config.json");
      field("columns", self.columns, "of its tables");
      field("follow", self.follow, "1 with the last piece: the host asks follow_case what comes of it");
      field("as_this_machine", self.as_this_machine,
            "1 with the last piece: a case that does not name probe, machine and mounting was measured with those of "
            "this box");
      field("by", self.by, "with as_this_machine: who says so");
    }
  };
  struct Answer {
    std::uint64_t result_id{};
    std::string refusal{};
    bool working{};
    std::vector<std::uint64_t> also{};
    static constexpr void fields(auto& self, auto&& field) {
      field("result_id", self.result_id, "of the proposed result, or of the stored refusal; 0 before the last piece");
      field("refusal", self.refusal, "why the data support no answer: its name, a colon and its reason; else empty");
      field("working", self.working, "1 when the box solves the case now: ask follow_case");
      field("also", self.also, "further results of the same case, each about a subject of its own");
    }
  };
};

// Names the progress of a proposed case.
enum class CaseProgress : std::uint8_t { working = 0, done = 1, cancelled = 2 };

// Reports the progress of a case that was proposed to be followed. After 5 s without this request the case is cancelled
// and nothing of it is stored.
struct FollowCase {
  static constexpr Operation kOperation = Operation::follow_case;
  struct Request {
    std::uint32_t number{};
    bool cancel{};
    static constexpr void fields(auto& self, auto&& field) {
      field("number", self.number, "of the case, as in propose_case");
      field("cancel", self.cancel, "1: give it up and store nothing, unless it is done");
    }
  };
  struct Answer {
    CaseProgress progress{};
    std::uint32_t elapsed_ms{};
    std::uint64_t result_id{};
    std::string refusal{};
    std::vector<std::uint64_t> also{};
    static constexpr void fields(auto& self, auto&& field) {
      field("progress", self.progress, "0 working, 1 done, 2 cancelled");
      field("elapsed_ms", self.elapsed_ms, "since the last piece came, while it works");
      field("result_id", self.result_id, "of the proposed result, or of the stored refusal; 0 unless done");
      field("refusal", self.refusal, "why the data support no answer: its name, a colon and its reason; else empty");
      field("also", self.also, "further results of the same case, each about a subject of its own");
    }
  };
};

}  // namespace probebox::messages
