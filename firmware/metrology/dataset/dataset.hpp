#pragma once
#include <cstddef>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "firmware/metrology/dataset/column.hpp"

namespace probebox::metrology {

// Value of one configuration key. Units are in the key ("sigma_mm").
using Matrix = std::vector<std::vector<double>>;
using Value = std::variant<double, bool, std::string, std::vector<double>, Matrix>;

struct Column {
  std::string name;  // unit included: "t_s", "x_mm"
  std::vector<double> values;

  friend bool operator==(const Column&, const Column&) = default;
};

// Measurements of one kind. Columns should have equal lengths; solvers check this.
struct Table {
  std::string name;
  std::vector<Column> columns;

  static Table withColumns(std::string name, const ColumnNames& column_names);

  // Length of the shortest column; 0 without columns.
  std::size_t rows() const;
  bool rectangular() const;
  const std::vector<double>* column(std::string_view column_name) const;

  // Appends one value per column, in their order. Asserts the number of values.
  void append(std::initializer_list<double> row);

  friend bool operator==(const Table&, const Table&) = default;
};

// A measured case: the folder of `probebox solve` in memory. Filled by capture, read and written by tools/case.
struct Dataset {
  std::string method;
  std::map<std::string, Value, std::less<>> config;  // all keys except the method
  std::vector<Table> tables;                         // table "machine" is the file machine.csv

  const Table* table(std::string_view name) const;

  friend bool operator==(const Dataset&, const Dataset&) = default;
};

// Makes a dataset with the empty tables "machine", "probe" and "touches".
Dataset touchDataset(std::string method);

}  // namespace probebox::metrology
