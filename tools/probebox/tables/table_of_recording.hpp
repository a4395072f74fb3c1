#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/link/recording.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/tables/row_writer.hpp"

// A recording as a table: one row a sample that was received. Samples that are missing have no row; where they are
// missing is said.
namespace probebox::command {

// Reads the recording, has its rows written, and says what is missing.
ExitStatus writeTable(const TableJob& job, RowWriter& writer, Console& console);

enum class Format : std::uint8_t { table, table_or_log };

// A table is CSV or NumPy, a log MCAP; any other suffix promises another format. A name without one, and a device, is
// CSV.
std::optional<std::string> objectionToFormat(const std::string& path, Format format);

}  // namespace probebox::command
