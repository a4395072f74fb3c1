#include "tools/probebox/view/assets.hpp"

#include <array>

// The assembler puts the files into the program as they are.
#define PROBEBOX_ASSET(name, file)                                                                     \
  asm(".section .rodata\n"                                                                             \
      ".global probebox_asset_" #name "_begin\n.global probebox_asset_" #name                          \
      "_end\n"                                                                                         \
      "probebox_asset_" #name "_begin:\n.incbin \"" PROBEBOX_PAGE "/" file "\"\nprobebox_asset_" #name \
      "_end:\n"                                                                                        \
      ".byte 0\n.previous\n");                                                                         \
  extern "C" const char probebox_asset_##name##_begin[];                                               \
  extern "C" const char probebox_asset_##name##_end[]

PROBEBOX_ASSET(html, "index.html");
PROBEBOX_ASSET(script, "app.js");
PROBEBOX_ASSET(style, "app.css");

namespace probebox::view {
namespace {

std::string_view between(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace

std::span<const Asset> assets() {
  static const std::array kAll{
      Asset{"/", "text/html; charset=utf-8", between(probebox_asset_html_begin, probebox_asset_html_end)},
      Asset{"/app.js", "text/javascript; charset=utf-8",
            between(probebox_asset_script_begin, probebox_asset_script_end)},
      Asset{"/app.css", "text/css; charset=utf-8", between(probebox_asset_style_begin, probebox_asset_style_end)},
  };
  return kAll;
}

}  // namespace probebox::view
