#include "tools/pages/man_page.hpp"

#include <CLI/CLI.hpp>
#include <sstream>

#include "tools/pages/described.hpp"

namespace probebox::pages {
namespace {

// Text that roff takes literally.
std::string literal(std::string_view text) {
  std::string out;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
    begins = c == '\n';
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

void writeOption(std::ostream& page, const Described& option) {
  page << ".TP\n";
  for (std::size_t i = 0; i < option.names.size(); ++i)
    page << (i > 0 ? ", " : "") << (option.positional ? "\\fI" : "\\fB") << literal(option.names[i]) << "\\fR";
  if (!option.value.empty()) page << " \\fI" << literal(option.value) << "\\fR";
  page << "\n" << literal(option.text);
  if (!option.choices.empty()) {
    page << " (";
    for (std::size_t i = 0; i < option.choices.size(); ++i) page << (i > 0 ? ", " : "") << literal(option.choices[i]);
    page << ")";
  }
  if (!option.usual.empty()) page << "; default: " << literal(option.usual);
  page << "\n";
}

void writeExample(std::ostream& page, const CLI::App& command) {
  const auto example = exampleOf(command);
  if (!example.empty()) page << ".PP\nExample:\n.PP\n.nf\n.RS\n" << literal(example) << ".RE\n.fi\n";
}

void writeCommand(std::ostream& page, const CLI::App& command) {
  page << ".SS " << literal(command.get_name());
  const auto options = optionsOf(command);
  for (const auto& option : options) {
    if (option.positional)
      page << " " << (option.required ? "" : "[") << upper(option.names.front()) << (option.required ? "" : "]");
  }
  page << "\n" << literal(command.get_description()) << "\n";
  for (const auto& option : options) {
    if (option.names.front() != "-h") writeOption(page, option);
  }
  writeExample(page, command);
}

}  // namespace

std::string manPage(const CLI::App& command, char section, std::string_view name, std::string_view purpose) {
  std::ostringstream page;
  const auto commands = commandsOf(command);
  page << ".\\\" Written by command_pages from the declarations that --help prints; see tools/pages.\n"
       << ".TH " << upper(std::string{name}) << " " << section << " \"\" \"probebox\"\n.SH NAME\n"
       << name << " \\- " << literal(purpose) << "\n.SH SYNOPSIS\n.B " << name << "\n[OPTIONS]"
       << (commands.empty() ? "" : " COMMAND [OPTIONS] [ARGUMENTS]") << "\n.SH DESCRIPTION\n"
       << literal(command.get_description()) << "\n.SH OPTIONS\n";
  for (const auto& option : optionsOf(command)) writeOption(page, option);
  if (!commands.empty()) page << ".SH COMMANDS\n";
  for (const auto* one : commands) writeCommand(page, *one);
  if (commands.empty()) page << ".SH EXAMPLES\n";
  writeExample(page, command);
  return page.str();
}

}  // namespace probebox::pages
