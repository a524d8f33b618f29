// Makes one HTML page of a report and its picture. The page opens without a network.
#pragma once

#include <string>

namespace cli {

/// Returns a page that loads nothing from outside: a title, a report as text, and a picture in HTML, such as
/// an <svg>.
std::string html_page(const std::string& title, const std::string& report, const std::string& picture);

/// Returns a PNG file as HTML that contains the picture itself, so that the page needs no other file.
std::string html_picture(const std::string& file);

}  // namespace cli
