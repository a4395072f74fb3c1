#include "tools/report/document_head.hpp"

#include "tools/report/html.hpp"
#include "tools/report/style.hpp"

namespace probebox::report {

std::string documentHead(const std::string& title, std::string_view own_style) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width\"/>\n" +
         element("title", title) + "\n<style>" + std::string{style()} + std::string{own_style} +
         "</style>\n</head>\n<body>\n";
}

}  // namespace probebox::report
