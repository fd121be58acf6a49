// Runs a fuzz target without a fuzzer, with any compiler: on the committed inputs, which are text
// (lines of hexadecimal bytes, comments after #), and on bytes at random.
//
//   replay TARGET FOLDER [RANDOM_INPUTS [SEED]]
//
// RANDOM_INPUTS: 40, or 200 in a long run (FLIPFREE_LONG); 25 times as many of what takes a
// millisecond. SEED: FLIPFREE_SEED, or 1.
// Exit status 1 at the first finding; the input is written as text to the standard output.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "finding.h"
#include "targets.h"

namespace {

using flipfree::fuzz::Target;
using Input = std::vector<std::uint8_t>;

Input read_text(const std::filesystem::path& path) {
  std::ifstream file(path);
  Input input;
  std::string line;
  while (std::getline(file, line)) {
    const std::string digits = line.substr(0, line.find('#'));
    std::string pair;
    for (const char c : digits) {
      if (c == ' ' || c == '\t' || c == '\r') continue;
      pair += c;
      if (pair.size() < 2) continue;
      input.push_back(static_cast<std::uint8_t>(std::stoul(pair, nullptr, 16)));
      pair.clear();
    }
  }
  return input;
}

void print_text(const Input& input) {
  for (std::size_t i = 0; i < input.size(); ++i)
    std::printf("%02x%s", input[i], i % 32 == 31 || i + 1 == input.size() ? "\n" : "");
}

long number(const char* variable, long otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atol(text);
}

bool run(const flipfree::fuzz::Target& target, const std::string& name, const Input& input) {
  // Said before, so that a crash has a name too.
  std::printf("%s\n", name.c_str());
  std::fflush(stdout);
  try {
    target.run({input.data(), input.size()});
    return true;
  } catch (const flipfree::fuzz::Finding& finding) {
    std::printf("FINDING: %s\n", finding.what.c_str());
  } catch (const std::exception& e) {
    std::printf("FINDING: a foreign exception: %s\n", e.what());
  }
  print_text(input);
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "replay TARGET FOLDER [RANDOM_INPUTS [SEED]]\n");
    return 2;
  }
  const auto all = flipfree::fuzz::targets();
  const auto target = std::find_if(all.begin(), all.end(), [&](const flipfree::fuzz::Target& t) {
    return std::string(t.name) == argv[1];
  });
  if (target == all.end()) {
    std::fprintf(stderr, "There is no target %s.\n", argv[1]);
    return 2;
  }
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(argv[2])) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[2]))
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    if (!run(*target, file.string(), read_text(file))) return 1;
  }
  const long inputs = argc > 3
                          ? std::atol(argv[3])
                          : (number("FLIPFREE_LONG", 0) != 0 ? 200 : 40) * (target->quick ? 25 : 1);
  const auto seed =
      static_cast<unsigned long>(argc > 4 ? std::atol(argv[4]) : number("FLIPFREE_SEED", 1));
  for (long i = 0; i < inputs; ++i) {
    std::seed_seq sequence{seed, static_cast<unsigned long>(i)};
    std::mt19937 random(sequence);
    Input input(random() % 200);
    for (std::uint8_t& byte : input) byte = static_cast<std::uint8_t>(random());
    if (!run(*target, "random input " + std::to_string(i) + " of seed " + std::to_string(seed),
             input))
      return 1;
  }
  std::printf("%zu committed inputs, %ld at random: no finding\n", files.size(), inputs);
  return 0;
}
