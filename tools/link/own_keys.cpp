#include "tools/link/own_keys.hpp"

#include <cstdlib>
#include <filesystem>

namespace probebox::link {
namespace {

std::filesystem::path fromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::filesystem::path{} : std::filesystem::path{value};
}

std::filesystem::path folderOfKeys() {
  if (auto folder = fromEnvironment("PROBEBOX_TLS"); !folder.empty()) return folder;
  if (auto config = fromEnvironment("XDG_CONFIG_HOME"); !config.empty()) return config / "probebox";
  return fromEnvironment("HOME") / ".config/probebox";
}

}  // namespace

Outcome<tls::Context> ownKeys() {
  const auto folder = folderOfKeys();
  auto context = tls::Context::load(tls::Side::host, {folder / "me.crt", folder / "me.key", folder / "boxes.crt"});
  if (context) return context;
  return Error{
      "a tls: box wants to know who you are, by me.crt, me.key and boxes.crt of " + folder.string() +
      " (PROBEBOX_TLS names another folder; whoever keeps the shop's keys makes them with probebox-keys person "
      "NAME): " +
      context.error().what};
}

}  // namespace probebox::link
