#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tools/probebox/screen/span.hpp"
#include "tools/probebox/text/machine_verdict.hpp"

namespace probebox::command {

// The words of `text` in lines of at most `columns`, at most `lines` of them; the last one ends with "..." where words
// are left out. A word, and so a number, is never cut; one that is longer than a line has a line of its own.
std::vector<std::string> wrapped(std::string_view text, std::size_t columns, std::size_t lines);
// Its first line.
std::string shortened(std::string_view text, std::size_t columns);

// The verdict on the machine with its reason, and what is known of each subject, as many as the rows hold.
std::vector<Span> machinePage(const MachineVerdict& verdict, ScreenSize size, bool utf8);

Style styleOf(MayCut may_cut);

}  // namespace probebox::command
