#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/dataset/subject.hpp"

// The descriptor of a method. Each method defines one `Method` beside its solver and has one line in
// firmware/metrology/methods.cpp. Checks of keys, type B inputs, `probebox solve --methods`, reports, subjects of
// results and the tables of docs/metrology.md come from it.
namespace probebox::metrology {

using Solver = Solved (*)(const Dataset&);
// Judges the values once their combined uncertainty is known; a refusal replaces the result.
using Judge = std::optional<Refusal> (*)(const Dataset&, Result&);
// One sentence about these readings, or nothing.
using Remark = std::optional<std::string> (*)(const Dataset&);
// Changes of columns of the tables by one unit of the known quantity that this sd is of, row by row; empty where the
// readings do not have it.
using MovedBy = std::vector<Table> (*)(const Dataset&, std::string_view sd_key);

struct MethodTable {
  std::string_view name;
  std::span<const MethodColumn> columns;
  std::string_view about;  // one row; and when it, or a column, may be missing
  bool readings{};         // a row is a reading with noise in several coordinates: two that are equal are copies
  bool contacts{};         // a row is a single contact, from one side
};

inline constexpr std::string_view kNeeded = "needed";

struct MethodKey {
  std::string_view name;      // unit included
  std::string_view fallback;  // the value without it; kNeeded; empty: it is optional and has none
  std::string_view about;
  std::optional<SubjectKind> names{};  // of a key "..._result": what the result that it names is about
  double least{}, most{};              // plausible values of it, in its unit; both 0: what the unit allows

  constexpr MethodKey within(double at_least, double at_most) const {
    return {name, fallback, about, names, at_least, at_most};
  }
  constexpr MethodKey upTo(double size) const { return within(-size, size); }
};

// Kind of a known quantity, which decides how its uncertainty is applied.
enum class KnownKind {
  size,    // a length of a piece: expands with temperature
  value,   // a number of the configuration, no piece
  table,   // every coordinate of the table of that name
  column,  // all cells of the column of that name together, in every table
  moves,   // in no cell by itself: it moves the readings as Method::moved_by says
};

// A quantity that the readings do not determine, and the key of its standard uncertainty.
struct KnownQuantity {
  std::string_view sd_key;
  std::string_view key;
  KnownKind kind{KnownKind::size};
  bool in_sd{};              // already included in the method's own sd
  std::string_view words{};  // for a person, where the key is not its first description: "certificate of the sphere"
};

// The quantity that a result answers. A new result replaces the one in force about the same subject.
struct MethodSubject {
  std::optional<Subject> about{};  // what its results usually are about
  // Where that depends on the case. Without any subject a result is about what its method is named.
  std::optional<Subject> (*of)(const Dataset& dataset){nullptr};
  std::span<const MethodKey> independent_of{};  // keys "..._result" that name results without an effect on it
};

// A subject of the results of one case.
struct NamedSubject {
  std::string name;                             // "stylus-offset-3"
  std::string needs{};                          // key of a value without which a result does not answer it; empty: none
  std::string kept_as{};                        // key of that value in the result about this subject; empty: the same
  std::span<const MethodKey> independent_of{};  // as that of a MethodSubject
};

struct Method {
  std::string_view name;
  std::string_view title;
  std::string_view equations;  // of docs/metrology.md
  std::string_view source;
  Solver solver{};
  Judge judge{};
  bool measures_machine{};  // its values are errors of the machine, so that those of MachineAccuracy move none of them
  std::span<const MethodTable> tables;
  std::span<const MethodKey> keys;  // every variant's; a key without effect in a variant is the solver's to warn about
  std::span<const KnownQuantity> known{};
  MovedBy moved_by{};                                // of those of kind `moves`
  std::span<const Quantity> results;                 // promised values, in the order of the answer
  std::span<const Quantity> further{};               // others that a result may have, as far as anybody knows their key
  std::span<const std::string_view> unobservable{};  // by any readings of this kind
  Remark undetermined{};                             // quantities that the readings of a case leave undetermined
  MethodSubject subject{};
  std::vector<NamedSubject> (*also_about)(const Dataset&){nullptr};  // quantities that the same readings determine
};

// True if the method relies on the length of a piece, which expands with temperature.
bool hasSize(const Method& method);

inline constexpr std::string_view kTemperatureKeys[]{"expansion_per_k", "sd_expansion_per_k", "sd_temperature_k"};

// Description of a column of the case; of a table that the method does not describe, as its other tables have the name.
// Role none where it has no such column.
MethodColumn columnOf(const Method& method, std::string_view table, std::string_view column);

// Description of the value of this key; null if the method describes none.
const Quantity* quantityOf(const Method& method, std::string_view key);

// A table without rows, with the columns that the method describes: those that may be missing only if they are in
// `also`.
Table emptyTable(const Method& method, std::string_view table, const ColumnNames& also = {});

// Keys sd_<known quantity> of the method, and of the temperature: see docs/metrology.md, "Uncertainty".
std::vector<std::string_view> typeBKeys(const Method& method);

// One sentence for every key of the case that the method does not take, so that a misspelt key is noticed; of more than
// twenty the last says how many.
std::vector<std::string> unusedKeys(const Dataset& dataset, const Method& method);

// The sentence about one key.
std::string unusedKey(std::string_view key, std::string_view method);

// What the result is about that this key of a case names by number; nothing if that may be anything.
std::optional<SubjectKind> subjectNamedBy(std::string_view key, const Method& method);

// Of the kind and the number that the key states; nothing without one.
std::optional<Subject> numberedSubject(const Dataset& dataset, SubjectKind kind, std::string_view key);

// Number of the tool that carries the probe, by the key `probe_tool`; 1 without it.
std::uint32_t probeToolOf(const Dataset& dataset);

// Subject of the offset from the spindle axis of the stylus that this tool carries: "stylus-offset-3".
std::string stylusOffsetSubject(std::uint32_t tool);

// Of the kind and the letter of key `axis`, of either case; nothing where the kind has no such axis.
std::optional<Subject> letteredSubject(const Dataset& dataset, SubjectKind kind);

}  // namespace probebox::metrology
