#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "tools/probebox/commands/planned_machine.hpp"
#include "tools/probebox/view/box_connection.hpp"

// Answers the requests of the page as JSON text.
namespace probebox::view {

// Every method that a box runs: its results, requirements and options.
std::string methods();
// What the box says of its machine; nothing where the connection has none that can say so, such as a recording.
std::optional<command::AskedBox> machineOf(BoxConnection& connection);
// Forecasts the uncertainty of a run, on a usual machine where no box has said what it has. It takes a while: not for
// the thread of the connection.
BoxConnection::Answer forecast(const std::string& method, const std::optional<command::AskedBox>& box);

// Tools whose holder the box knows: number, holder_length_mm, and length_mm beyond the holder, as they are in store.
BoxConnection::Answer stores(link::Client& box, Console& console);

BoxConnection::Answer results(link::Client& box, Console& console);
// One result with every value, its history, and the values as text, to the digits that U justifies.
BoxConnection::Answer result(link::Client& box, Console& console, std::uint64_t id);
BoxConnection::Answer history(link::Client& box, Console& console, const std::string& subject);
// Compares a result with the one in force. Null where nothing can be compared.
BoxConnection::Answer comparison(link::Client& box, Console& console, std::uint64_t id);
// The page that `probebox report` writes.
BoxConnection::Answer reportPage(link::Client& box, Console& console, std::uint64_t id);

// body: JSON from the page. Refusals are those of the commands.
BoxConnection::Answer start(link::Client& box, Console& console, const std::string& body);
BoxConnection::Answer abortRun(link::Client& box, Console& console, const std::string& body);
BoxConnection::Answer mark(link::Client& box, Console& console, const std::string& body);
BoxConnection::Answer accept(link::Client& box, Console& console, const std::string& body);
BoxConnection::Answer rollback(link::Client& box, Console& console, const std::string& body);

}  // namespace probebox::view
