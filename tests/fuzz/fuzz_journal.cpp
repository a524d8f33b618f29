#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <unistd.h>

#include "check.hpp"
#include "input.hpp"
#include "targets.hpp"
#include "tools/files/user_error.hpp"
#include "tools/sweep/journal.hpp"
#include "tools/sweep/study.hpp"
#include "tools/sweep/table_file.hpp"

namespace fuzz {
namespace {

const std::string column_ends =
    R"("type":"whole","unit":""},{"measured":false,"name":"force","type":"number","unit":"N"},)"
    R"({"measured":true,"name":"time","type":"number","unit":"s"},)"
    R"({"measured":false,"name":"failure","type":"text","unit":""}],)";
/// First line of a journal of three rows.
const std::string sound_header = R"({"columns":[{"measured":false,"name":"row",)" + column_ends +
                                 R"("rows":3,"schema":"bristle-sweep-journal-1","study":"s"})";

/// Text of the words that journals are made of, which bytes at random seldom make.
std::string any_text(Input& input) {
  const std::string words[] = {sound_header + "\n",
                               R"({"columns":[{"measured":false,"name":"row",)" + column_ends,
                               R"("rows":)",
                               R"("schema":"bristle-sweep-journal-1","study":"s"})",
                               R"({"columns":[)",
                               R"({"measured":true,"name":"a","type":"text","unit":"N"})",
                               R"(,"vary":["a","b"]})",
                               "[0,0.5,1e-3,null]\n",
                               "[1,-2.5,2e-3,\"it \\u0000 failed\"]\n",
                               "[2,1e308,null,null]\n",
                               "[0,0.5,7e-3,null]\n",
                               "[0,0.6,1e-3,null]\n",
                               "[3,",
                               "[1,",
                               "null",
                               "\"a\"",
                               "1e18",
                               "-7",
                               "18446744073709551615",
                               "0.5",
                               "{",
                               "}",
                               "[",
                               "]",
                               ",",
                               "\n"};
  std::string text;
  if (input.flag()) text = sound_header + "\n";
  while (!input.empty() && text.size() < 2000) text += words[input.choice(std::size(words))];
  return text;
}

/// Whether a journal says that its study has very many rows, each of which takes memory.
bool is_vast(const std::string& text) {
  const std::size_t at = text.find("\"rows\":");
  if (at == std::string::npos) return false;
  const double rows = std::strtod(text.c_str() + at + 7, nullptr);
  return rows > 1e5 && rows < 1e8;
}

/// A folder of this process, gone at its end.
struct Folder {
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "bristle_fuzz_XXXXXX").string();
    check(mkdtemp(name.data()) != nullptr, "a temporary folder can be made");
    path = name;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

std::string read_all(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void read(const std::string& path) {
  try {
    const cli::SweepRows rows = cli::read_journal(path);
    check(rows.done <= rows.rows.size(), "no more rows are done than there are");
    static_cast<void>(cli::columns_of(rows.header));
    const std::string hash = rows.table_hash();
    static_cast<void>(cli::table_csv(rows));
    cli::SweepRows twice = cli::read_journal(path);
    cli::add_journal(twice, path);
    check(twice.done == rows.done && twice.table_hash() == hash, "a journal joined with itself is the same");
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

/// Goes on with the journal, as a sweep that was killed does.
void go_on(const std::string& path) {
  const std::string before = read_all(path);
  try {
    std::uint64_t done = 0;
    {
      cli::Journal journal(path, nlohmann::json::parse(sound_header));
      check(journal.found() == journal.rows().done, "rows found are rows done");
      journal.add("[2,1e308,null,null]");
      done = journal.rows().done;
    }
    check(cli::read_journal(path).done == done, "rows that were added are read again");
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
    // The file may only have lost a torn last line, so it is a prefix of what it was.
    check(before.starts_with(read_all(path)), "a journal that is refused is not written");
  }
}

}  // namespace

void journal(Bytes bytes) {
  static const Folder folder;
  const std::string path = (folder.path / "study.journal").string();
  Input input(bytes);
  const unsigned kind = input.choice(8);
  const std::string raw(reinterpret_cast<const char*>(bytes.data()) + (bytes.empty() ? 0 : 1),
                        bytes.empty() ? 0 : bytes.size() - 1);
  const std::string text = kind % 2 == 0 ? raw : any_text(input);
  if (is_vast(text)) return;
  std::string file;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string line = text.substr(start, end - start);
    if (kind < 6) file += cli::text_hash(line) + " ";  // else a hash is whatever the bytes say
    file += line + "\n";
    start = end + 1;
  }
  if (kind == 5 && !file.empty()) file.pop_back();  // torn
  std::ofstream(path, std::ios::binary) << file;
  read(path);
  go_on(path);
}

}  // namespace fuzz
