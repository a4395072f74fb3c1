#pragma once
#include <cstddef>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace probebox::metrology {

// What the box is told about a measurement: the value of one key of the configuration. Units are in the key
// ("sigma_mm").
using Matrix = std::vector<std::vector<double>>;
using Value = std::variant<double, bool, std::string, std::vector<double>, Matrix>;

struct Column {
  std::string name;  // unit included: "t_s", "x_mm"
  std::vector<double> values;

  friend bool operator==(const Column&, const Column&) = default;
};

// Measurements of one kind. All columns have the same length unless somebody else filled them: solvers check.
struct Table {
  std::string name;
  std::vector<Column> columns;

  static Table withColumns(std::string name, std::span<const std::string_view> column_names);

  // The number of rows of the shortest column; 0 without columns.
  std::size_t rows() const;
  bool rectangular() const;
  const std::vector<double>* column(std::string_view column_name) const;

  // One value a column, in the order of the columns. A row of another width is a programming error (asserted).
  void append(std::initializer_list<double> row);

  friend bool operator==(const Table&, const Table&) = default;
};

// A measured case: the folder of `probebox solve` in memory. Capture fills it, tools/case reads and writes it.
struct Dataset {
  std::string method;
  std::map<std::string, Value, std::less<>> config;  // without the method
  std::vector<Table> tables;                         // table "machine" is the file machine.csv

  const Table* table(std::string_view name) const;

  friend bool operator==(const Dataset&, const Dataset&) = default;
};

// The three tables of every touch method. Streams are at their native rates, each with its own stamps on the master
// clock. machine: position of the moving reference. probe: raw deflection channels. touches: outward normal n of the
// surface, unit direction u of the retract, nominal speed.
inline constexpr std::string_view kMachineColumns[]{"touch", "t_s", "x_mm", "y_mm", "z_mm"};
inline constexpr std::string_view kProbeColumns[]{"touch", "t_s", "a", "b", "c"};
inline constexpr std::string_view kTouchesColumns[]{"touch", "nx", "ny", "nz", "ux", "uy", "uz", "speed_mm_s"};

// A dataset with the empty tables "machine", "probe" and "touches", in this order.
Dataset touchDataset(std::string method);

}  // namespace probebox::metrology
