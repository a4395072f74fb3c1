#pragma once
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/method.hpp"

// What people call the subjects of results, and what one wants to know when one measures them.
namespace probebox::command {

// "Rotary axis C" for "rotary-c"; of a name that is no subject the name itself, with spaces for its dashes.
std::string subjectTitle(std::string_view subject);

// "Title" of the method where one is named so, else the name itself.
std::string methodTitle(std::string_view method);

// One of "delay", "axis", "tool", "head", "table", "screw" and "machine": under which a person looks for the method.
std::string_view groupOf(const metrology::Method& method);

}  // namespace probebox::command
