#include "tools/probebox/box.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/io/rendezvous.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kGlance{500};
constexpr const char* kHowToGetABox =
    "`probeboxd --board sim` starts an emulated one, -u URI or PROBEBOX_URI names another";

Trouble noBox(const std::string& why) {
  return {ExitStatus::no_box, "no-box", why};
}

// TCP first: a serial line serves one host only.
std::string preferred(const std::vector<std::string>& uris) {
  const auto tcp = std::ranges::find_if(uris, [](const std::string& uri) { return uri.starts_with("tcp:"); });
  return tcp != uris.end() ? *tcp : uris.empty() ? std::string{} : uris.front();
}

// A killed box leaves its announcement behind, and another process may have its number by now.
bool takesNobody(const std::string& text) {
  const auto uri = link::parseUri(text);
  return !uri || !link::open(*uri, kGlance);
}

Outcome<std::string, Trouble> announced() {
  std::vector<std::string> boxes;
  for (const auto& announcement : io::rendezvous::listed()) {
    if (auto uri = preferred(announcement.uris); !uri.empty()) boxes.push_back(std::move(uri));
  }
  if (boxes.size() > 1) std::erase_if(boxes, takesNobody);
  if (boxes.empty()) return std::string{kUsualUri};
  if (boxes.size() == 1) return boxes.front();
  std::string all;
  for (const auto& uri : boxes) all += " " + uri;
  return usage("several boxes run here; name one with -u:" + all);
}

}  // namespace

Trouble usage(std::string what) {
  return {ExitStatus::usage, "usage", std::move(what)};
}

Outcome<link::Uri, Trouble> chooseUri(const std::string& given) {
  std::string text = given;
  if (const char* environment = std::getenv("PROBEBOX_URI"); text.empty() && environment != nullptr) text = environment;
  if (text.empty()) {
    auto found = announced();
    if (!found) return found.error();
    text = std::move(found).value();
  }
  auto uri = link::parseUri(text);
  if (!uri) return usage(uri.error().what);
  return std::move(uri).value();
}

Trouble troubleOf(const link::Failure& failure, const Console& console) {
  if (console.interrupted()) return {ExitStatus::interrupted, "interrupted", "interrupted"};
  switch (failure.kind) {
    case link::Failure::Kind::box_refused:
      return {ExitStatus::box_refused, std::string{messages::nameOf(failure.code)}, "the box refused: " + failure.what};
    case link::Failure::Kind::no_protocol:
      return {ExitStatus::no_box, "no-box", failure.what};
    case link::Failure::Kind::timed_out:
      return {ExitStatus::no_box, "timed-out", failure.what};
    default:
      return {ExitStatus::no_box, "link-lost", failure.what};
  }
}

link::Wait patienceOf(const Console& console, milliseconds limit) {
  return link::patience(limit, &console.interruption());
}

Outcome<Box, Trouble> openBox(const link::Uri& uri, const Console& console, milliseconds patience,
                              link::StreamListener* listener, const link::ClientOptions& options) {
  auto pipe = link::open(uri, patience);
  if (!pipe) return noBox("no box answers: " + pipe.error().what + "; " + kHowToGetABox);
  auto box = std::make_unique<link::Client>(std::move(pipe).value(), options, listener);
  const auto welcome = box->connect(patienceOf(console, patience));
  if (!welcome) {
    auto trouble = troubleOf(welcome.error(), console);
    if (trouble.status == ExitStatus::no_box) trouble.what = "no box answers at " + uri.text + ": " + trouble.what;
    return trouble;
  }
  return box;
}

Outcome<Box, Trouble> openBox(const std::string& given, const Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return uri.error();
  if (uri->isFile()) {
    return usage(uri->text +
                 " is a recording, which cannot answer; see `probebox info` and `probebox export`, or name a box");
  }
  return openBox(*uri, console);
}

}  // namespace probebox::command
