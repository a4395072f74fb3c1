#include "store_entry.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "firmware/store/store.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;
namespace fs = std::filesystem;
using store::Store;

const store::Binding kDelay{"delay", "P-1", "mill", "spindle"};
const store::Binding kScrew{"screw-x", "P-1", "mill", "spindle"};

metrology::Result resultOf(const char* method, const char* key, double value) {
  metrology::Result result;
  result.method = method;
  result.estimates = {metrology::Estimate::scalar(key, value, 0.01 * value)};
  result.convention = "as stored";
  return result;
}

// What a box reads of a result before it believes it.
std::string told(const store::Record& record) {
  std::string text = record.binding.subject + " " + record.method + " " + std::string{store::name(record.state)} + " " +
                     record.accepted_by + " " + record.accepted_utc;
  if (const auto* result = record.result())
    for (const auto& each : result->estimates)
      for (const auto value : each.values) text += " " + each.key + " " + std::to_string(value * 1e9);
  if (const auto* refusal = record.refusal()) text += " " + refusal->name + " " + refusal->reason;
  return text;
}

using Content = std::map<store::Id, std::string>;

Content contentOf(Store& store) {
  Content content;
  for (store::Id id = 1; id < 10; ++id)
    if (const auto record = store.find(id)) content[id] = told(*record);
  return content;
}

class Folder {
 public:
  Folder() { makeStore(); }

  const std::string& sound() const { return sound_; }
  const Content& content() const { return content_; }

  std::string put(const std::string& bytes) const {
    for (const auto& entry : fs::directory_iterator{folder_.path()}) fs::remove_all(entry);
    const auto file = folder_.file("results.db");
    std::ofstream{file, std::ios::binary} << bytes;
    return file;
  }

 private:
  void makeStore() {
    const auto file = folder_.file("results.db");
    {
      auto store = Store::open(file);
      require(store.ok());
      const auto propose = [&](const store::Binding& about, const metrology::Result& result) {
        return store->propose(about, result, std::string(500, 'd'), "t0").value();
      };
      const auto first = propose(kDelay, resultOf("delay-multi-speed", "tau_s", 5.1998e-3));
      require(decided::accept(*store, first, "Ada", "t1").ok());
      const auto second = propose(kDelay, resultOf("delay-in-out", "tau_s", 5.2e-3));
      require(decided::accept(*store, second, "Grace", "t2").ok());
      const auto third = propose(kDelay, resultOf("delay-in-out", "tau_s", 5.3e-3));
      require(decided::accept(*store, third, "Grace", "t3", true).ok());
      require(decided::accept(*store, propose(kScrew, resultOf("screw-calibration", "K", 0.97)), "Ada", "t4").ok());
      propose(kScrew, resultOf("screw-calibration", "K", 0.95));
      require(store->refuse(kScrew, "screw-calibration", {"noisy", "too noisy"}, "{}", "t5").ok());
      content_ = contentOf(*store);
    }
    std::ifstream in{file, std::ios::binary};
    sound_.assign(std::istreambuf_iterator<char>{in}, {});
  }

  support::TemporaryFolder folder_{support::inMemory()};
  std::string sound_;
  Content content_;
};

std::string changed(std::string bytes, std::span<const std::uint8_t> how) {
  if (how.empty()) return bytes;
  if (how[0] >= 0x80) bytes.resize(bytes.size() * (how[0] - 0x80U) / 0x80U);
  constexpr std::size_t kChange = 5;
  for (auto rest = how.subspan(1); rest.size() >= kChange && !bytes.empty(); rest = rest.subspan(kChange)) {
    const std::size_t at = (rest[0] * 65536U + rest[1] * 256U + rest[2]) % bytes.size();
    const std::size_t count = std::min<std::size_t>(1U + rest[4], bytes.size() - at);
    for (std::size_t k = 0; k < count; ++k) bytes[at + k] = static_cast<char>(bytes[at + k] ^ rest[3]);
  }
  return bytes;
}

}  // namespace

int feedStore(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  static const Folder folder;
  const auto bytes = changed(folder.sound(), {data, size});
  const auto file = folder.put(bytes);
  auto store = Store::openAnyhow(file);
  const auto& stored = folder.content();
  const auto content = contentOf(store);
  for (const auto& [id, says] : content) {
    const auto original = stored.find(id);
    require(original != stored.end() && original->second == says, says);
  }
  const bool says_so = !store.notice().empty() || !store.whyNotWritable().empty() || !store.damage().empty();
  // One that another has replaced is told when it is asked for.
  for (const auto& [id, said] : stored) {
    if (content.contains(id) || says_so) continue;
    const auto found = store.find(id);
    require(!found && found.error().reason == store::Reason::damaged, "a result is lost without a word");
  }
  // It goes on, or says why not.
  const auto next = store.propose(kDelay, resultOf("delay-in-out", "tau_s", 1e-3), "", "t9");
  require(next.ok() || !next.error().what.empty());
  require(next.ok() || !store.whyNotWritable().empty() || next.error().reason != store::Reason::damaged,
          next.ok() ? "" : next.error().what);
  return 0;
}
