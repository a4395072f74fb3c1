#include <array>
#include <cctype>
#include <sstream>
#include <string>

#include "protocol/modbus/map.hpp"
#include "protocol/modbus/page.hpp"
#include "protocol/modbus/refusals.hpp"

namespace probebox::modbus {
namespace {

constexpr std::array<std::string_view, 6> kKinds{"u16", "i16", "i16_plus_32768", "u32", "i32", "f32"};
constexpr std::array<std::string_view, 6> kHalTypes{"u32", "float", "float", "u32", "float", "float"};

std::string quoted(std::string_view text) {
  std::string out{'"'};
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

void put(std::ostream& out, const Register& entry) {
  const auto kind = static_cast<std::size_t>(entry.kind);
  out << R"({"address": )" << entry.address << R"(, "name": )" << quoted(entry.name) << R"(, "kind": )"
      << quoted(kKinds[kind]) << R"(, "registers": )" << registersOf(entry.kind) << R"(, "scale": )" << entry.scale
      << R"(, "unit": )" << quoted(entry.unit) << R"(, "access": )"
      << (entry.access == Access::write ? R"("write")" : R"("read")");
  if (entry.rows > 1) out << R"(, "rows": )" << entry.rows << R"(, "row_registers": )" << entry.row_registers;
  out << R"(, "hal_pin": )" << quoted(halPinOf(entry)) << R"(, "hal_type": )" << quoted(kHalTypes[kind])
      << R"(, "hal_direction": )" << (entry.access == Access::write ? R"("in")" : R"("out")") << R"(, "meaning": )"
      << quoted(entry.meaning) << "}";
}

template <class All>
void list(std::ostream& out, std::string_view name, const All& all, auto&& put_one) {
  out << quoted(name) << ": [";
  const char* before = "\n  ";
  for (const auto& each : all) {
    out << before;
    put_one(each);
    before = ",\n  ";
  }
  out << "\n]";
}

}  // namespace

std::string halPinOf(const Register& entry) {
  std::string name{"probebox."};
  for (const char c : entry.name) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter) != 0) {
      name += static_cast<char>(std::tolower(letter));
    } else if (name.back() != '-' && name.back() != '.') {
      name += '-';
    }
  }
  while (name.back() == '-') name.pop_back();
  if (entry.kind == Kind::i16) name += "-i16";
  if (entry.kind == Kind::offset_i16) name += "-offset";
  if (entry.unit == "nm" || entry.unit == "ns") name += "-" + std::string{entry.unit};
  return name;
}

std::string mapAsJson(std::span<const MethodNumber> methods) {
  std::ostringstream out;
  out << "{\n\"map_version\": " << kMapVersion << ",\n\"magic\": " << kMagic
      << ",\n\"register_count\": " << kRegisterCount << ",\n";
  list(out, "registers", registers(), [&](const Register& entry) { put(out, entry); });
  out << ",\n";
  list(out, "methods", methods, [&](const MethodNumber& method) {
    out << R"({"number": )" << method.number << R"(, "name": )" << quoted(method.name) << "}";
  });
  out << ",\n";
  list(out, "refusals", refusalCodes(), [&](const RefusalCode& refusal) {
    out << R"({"code": )" << refusal.code << R"(, "text": )" << quoted(refusal.text) << "}";
  });
  out << "\n}\n";
  return out.str();
}

}  // namespace probebox::modbus
