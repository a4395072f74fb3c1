#pragma once
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::report {

// A strict reader of the XML that reports use. Returns the first error with the text at its place; empty without one.
// Every element must be closed in order, every attribute quoted and unique, every & begin a predefined entity.
class WellFormed {
 public:
  static std::string objectionTo(std::string_view text) {
    WellFormed reader{text};
    return reader.read();
  }

 private:
  explicit WellFormed(std::string_view text) : text_{text} {}

  std::string here() const { return std::string{text_.substr(at_, 60)}; }
  bool starts(std::string_view with) const { return text_.substr(at_).starts_with(with); }

  std::string read() {
    if (starts("<!DOCTYPE html>")) at_ += 15;
    while (at_ < text_.size()) {
      std::string bad;
      if (text_[at_] == '<') {
        bad = starts("</") ? close() : open();
      } else if (text_[at_] == '&') {
        bad = entity();
      } else if (text_[at_] == '>' || static_cast<unsigned char>(text_[at_]) < 9) {
        bad = "stray character";
      } else {
        ++at_;
      }
      if (!bad.empty()) return bad + " at: " + here();
    }
    return open_.empty() ? "" : "never closed: " + open_.back();
  }

  std::string entity() {
    for (const std::string_view known : {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"}) {
      if (!starts(known)) continue;
      at_ += known.size();
      return "";
    }
    return "unknown entity";
  }

  std::string name() {
    const auto from = at_;
    const auto is_part = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == ':' || c == '_';
    };
    while (at_ < text_.size() && is_part(text_[at_])) ++at_;
    return std::string{text_.substr(from, at_ - from)};
  }

  void spaces() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }

  std::string close() {
    at_ += 2;
    const auto element = name();
    if (open_.empty() || open_.back() != element) return "closes what is not open: " + element;
    open_.pop_back();
    return take('>') ? "" : "no end of a tag";
  }

  bool take(char wanted) {
    if (at_ >= text_.size() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }

  std::string open() {
    ++at_;
    const auto element = name();
    if (element.empty()) return "no name of an element";
    std::vector<std::string> seen;
    for (spaces(); at_ < text_.size() && text_[at_] != '>' && text_[at_] != '/'; spaces()) {
      const auto attribute = name();
      for (const auto& other : seen) {
        if (other == attribute) return "twice the attribute " + attribute;
      }
      seen.push_back(attribute);
      if (attribute.empty() || !take('=') || !take('"')) return "no attribute in quotes";
      while (at_ < text_.size() && text_[at_] != '"') {
        if (text_[at_] == '<') return "< inside an attribute";
        if (text_[at_] == '&') {
          if (auto bad = entity(); !bad.empty()) return bad;
        } else {
          ++at_;
        }
      }
      if (!take('"')) return "an attribute without end";
    }
    if (take('/')) return take('>') ? "" : "no end of a tag";
    open_.push_back(element);
    return take('>') ? "" : "no end of a tag";
  }

  std::string_view text_;
  std::size_t at_{};
  std::vector<std::string> open_;
};

}  // namespace probebox::report
