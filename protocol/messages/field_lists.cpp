// Writes a reader in another language: `field_lists LANGUAGE TEMPLATE` prints the template with the field lists of
// every message in the place of the line @FIELD_LISTS@. LANGUAGE: lua or python.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/messages/cases.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/messages/structure_name.hpp"

namespace probebox::messages {
namespace {

struct Language {
  char open{};
  char close{};
  std::string_view trailing;  // behind the only item of a list
  std::string_view key_open;  // "[1] = " or "1: "
  std::string_view key_close;
  char map_open{};
  char map_close{};
};
constexpr Language kLua{'{', '}', "", "[", "] = ", '{', '}'};
constexpr Language kPython{'(', ')', ",", "", ": ", '{', '}'};

std::string literal(std::string_view text) {
  std::string all = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') all += '\\';
    all += c;
  }
  return all + "\"";
}

// Field lists by the name of their structure, in the syntax of one language.
class FieldLists {
 public:
  explicit FieldLists(const Language& language) : in_{language} {}

  template <class T>
  void add(const std::string& name) {
    if (structures_.contains(name)) return;
    structures_[name];  // one that holds itself would end here
    std::string fields;
    const T value{};
    T::fields(value, [&](std::string_view field, const auto& member, std::string_view doc, auto&&...) {
      fields += "    " + list({literal(field), type<std::decay_t<decltype(member)>>(), literal(doc)}) + ",\n";
    });
    structures_[name] = in_.open + std::string{"\n"} + fields + "  " + in_.close;
  }
  template <class M>
  void message() {
    std::string name{nameOf(M::kType)};
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    add<M>(name);
    messages_ += entry(std::to_string(static_cast<unsigned>(M::kType)), literal(name));
    written_.insert(nameOf(M::kType));
  }
  template <class Op>
  void operation() {
    const std::string name{nameOf(Op::kOperation)};
    add<typename Op::Request>(name + "_request");
    add<typename Op::Answer>(name + "_answer");
    operations_ += entry(std::to_string(static_cast<unsigned>(Op::kOperation)), literal(name));
    written_.insert(nameOf(Op::kOperation));
  }

  // A message without fields of its own.
  void exempt(std::string_view name) { written_.insert(name); }
  // Names of this enumeration that no reader would know.
  template <class Enum>
  std::string missing() const {
    std::string all;
    for (std::underlying_type_t<Enum> number = 1; nameOf(static_cast<Enum>(number)) != kUnknown; ++number) {
      const auto name = nameOf(static_cast<Enum>(number));
      if (!written_.contains(name)) all += " " + std::string{name};
    }
    return all;
  }

  std::string text() const {
    std::string structures;
    for (const auto& [name, fields] : structures_) structures += entry(literal(name), fields);
    return map("STRUCTURES", structures) + map("MESSAGES", messages_) + map("OPERATIONS", operations_);
  }

 private:
  std::string list(const std::vector<std::string>& items) const {
    std::string all(1, in_.open);
    for (std::size_t k = 0; k < items.size(); ++k) all += (k == 0 ? "" : ", ") + items[k];
    if (items.size() == 1) all += in_.trailing;
    return all + in_.close;
  }
  std::string entry(const std::string& key, const std::string& value) const {
    return "  " + std::string{in_.key_open} + key + std::string{in_.key_close} + value + ",\n";
  }
  std::string map(std::string_view name, const std::string& entries) const {
    return std::string{name} + " = " + in_.map_open + "\n" + entries + in_.map_close + "\n";
  }

  template <class T>
  std::string type() {
    if constexpr (std::same_as<T, bool>) {
      return list({literal("bool")});
    } else if constexpr (std::same_as<T, double>) {
      return list({literal("f64")});
    } else if constexpr (std::same_as<T, MonoTime> || std::same_as<T, Tick> || std::same_as<T, SampleIndex>) {
      return list({literal("i64")});
    } else if constexpr (std::same_as<T, std::byte>) {
      return list({literal("u8")});
    } else if constexpr (std::is_enum_v<T>) {
      return type<std::underlying_type_t<T>>();
    } else if constexpr (std::integral<T>) {
      return list({literal((std::is_signed_v<T> ? "i" : "u") + std::to_string(8 * sizeof(T)))});
    } else if constexpr (Text<T>) {
      return list({literal("text")});
    } else if constexpr (Bytes<T>) {
      return list({literal("bytes")});
    } else if constexpr (detail::kIsArray<T>) {
      return list({literal("array"), std::to_string(std::tuple_size_v<T>), type<typename T::value_type>()});
    } else if constexpr (detail::kIsVector<T>) {
      return list({literal("list"), type<typename T::value_type>()});
    } else {
      add<T>(structureName<T>());
      return list({literal("structure"), literal(structureName<T>())});
    }
  }

  static constexpr std::string_view kUnknown = "unknown";

  const Language& in_;
  std::map<std::string, std::string> structures_;
  std::set<std::string_view> written_;  // messages and operations
  std::string messages_;
  std::string operations_;
};

// Ends the build where a message or operation is not listed here.
std::string fieldLists(const Language& language) {
  FieldLists all{language};
  all.add<frame::Header>("frame_header");
  all.add<codec::BlockHeader>("block_header");
  const auto messages = [&]<class... M>() { (all.message<M>(), ...); };
  messages.operator()<Hello, Welcome, Descriptor, TestPattern, Start, Stop, Credit, Gap, Trigger, TriggerGap, Heartbeat,
                      HeartbeatChange, ShortSamples, Request, Answer, Refusal>();
  const auto operations = [&]<class... Op>() { (all.operation<Op>(), ...); };
  operations.operator()<Status, PostMarker, StartProcedure, ProcedureStatus, AbortProcedure, ListResults, AcceptResult,
                        Corrections, GetDataset, RollbackResult, ResultHistory, SetInhibit, HomeAxes, EnableSources,
                        LoopBack, TellPose, ProposeCase, FollowCase, GetResult, TellPositions, Provision, DescribeUnit,
                        OfferUpdate, SendUpdate, InstallUpdate, UpdateStatus, DescribeMachine, ProvisionKeys>();
  all.exempt(nameOf(MessageType::samples));       // its payload is a block of protocol/codec
  all.exempt(nameOf(MessageType::samples_head));  // the same without its columns
  if (const auto missing = all.missing<MessageType>() + all.missing<Operation>(); !missing.empty()) {
    std::cerr << "protocol/messages/field_lists.cpp does not list" << missing << "\n";
    std::exit(1);
  }
  return all.text();
}

}  // namespace
}  // namespace probebox::messages

int main(int argc, char** argv) {
  using namespace probebox::messages;
  const std::string_view language = argc == 3 ? argv[1] : "";
  std::ifstream in{argc == 3 ? argv[2] : ""};
  if ((language != "lua" && language != "python") || !in) {
    std::cerr << "usage: field_lists lua|python TEMPLATE\n";
    return 2;
  }
  for (std::string line; std::getline(in, line);)
    std::cout << (line == "@FIELD_LISTS@" ? fieldLists(language == "lua" ? kLua : kPython) : line + "\n");
  return std::cout.flush() ? 0 : 1;
}
