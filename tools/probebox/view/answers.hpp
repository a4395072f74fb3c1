#pragma once
#include <cstdint>
#include <string>

#include "tools/probebox/view/desk.hpp"

// What a page asks of the box, as JSON text.
namespace probebox::view {

// Every method that a box runs: what it finds and needs, and which options it takes.
std::string methods();
// The uncertainty that a run will have; no box is asked.
Desk::Answer forecast(const std::string& method);

Desk::Answer results(link::Client& box, Console& console);
// One with every value, its history, and the words in which values are read, to the digits that U justifies.
Desk::Answer result(link::Client& box, Console& console, std::uint64_t id);
Desk::Answer history(link::Client& box, Console& console, const std::string& subject);
// Beside the one in force. Null where nothing can be compared.
Desk::Answer comparison(link::Client& box, Console& console, std::uint64_t id);
// The page that `probebox report` writes.
Desk::Answer reportPage(link::Client& box, Console& console, std::uint64_t id);

// body: JSON of the page. Each is refused as the command of that name is.
Desk::Answer start(link::Client& box, Console& console, const std::string& body);
Desk::Answer abortRun(link::Client& box, Console& console, const std::string& body);
Desk::Answer mark(link::Client& box, Console& console, const std::string& body);
Desk::Answer accept(link::Client& box, Console& console, const std::string& body);
Desk::Answer rollback(link::Client& box, Console& console, const std::string& body);

}  // namespace probebox::view
