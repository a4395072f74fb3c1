#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/link/recording.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/tables/row_writer.hpp"

// Converts a recording to a table with one row per received sample. Missing samples have no row and are reported.
namespace probebox::command {

// Reads the recording, writes its rows, and reports missing samples.
ExitStatus writeTable(const TableJob& job, RowWriter& writer, Console& console);

enum class Format : std::uint8_t { table, table_or_log };

// Refuses an output whose suffix names another format. A table is CSV or NumPy, a log is MCAP; a device or a name
// without suffix is CSV.
std::optional<std::string> objectionToFormat(const std::string& path, Format format);

}  // namespace probebox::command
