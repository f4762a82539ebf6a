#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the commands that the documentation shows and compares what they print.

usage: docs_commands_test.py --bin BUILD/bin FILE.md...

A fenced block after a line `<!-- run -->` is run: lines that begin with "$ " are commands, the others what they
print, standard error included. Times, sizes in bytes, ports, numbers of messages, servers and threads, and the numbers
in rows of tables may differ; "…" stands for any text within a line, and a line that is only "…" for any lines. A command that fails
must say so: `<!-- run, fails -->`. A command that ends in "&" stays until the file ends, and the next one
waits until it has printed what the page shows. Blocks of one file share a folder and a shell. The port 7100 of the
pages is replaced by a free one. A block of ">>> " lines is a session of /usr/bin/python3, one for the whole file, in the
same folder, which finds the package of the build. `<!-- as FILE -->` before a block writes the block into FILE instead.

Also: every flag that these pages name is one that some program's --help lists (flags of other programs stand in sh
blocks, which are left out), and every relative link of every page leads to a file.
"""
import argparse
import json
import os
import re
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

PAGE_PORT = "7100"
MARK = re.compile(r"<!-- (run|run, fails|as (\S+)) -->\s*$")


def blocks_of(page):
    """(line number, whether its commands fail, file to write, lines) of each marked block."""
    mark = None
    lines = open(page, encoding="utf-8").read().split("\n")
    i = 0
    while i < len(lines):
        match = MARK.match(lines[i])
        if match:
            mark = match
        elif lines[i].startswith("```") and mark:
            end = lines.index("```", i + 1)
            yield i + 1, "fails" in mark.group(1), mark.group(2), lines[i + 1:end]
            mark, i = None, end
        elif lines[i].strip():
            mark = None
        i += 1


def commands_of(lines):
    """(command, what it prints) in order."""
    result = []
    for line in lines:
        if line.startswith("$ "):
            result.append((line[2:], []))
        elif result and result[-1][0].endswith("\\"):
            result[-1] = (result[-1][0] + "\n" + line, [])
        elif result:
            result[-1][1].append(line)
    return result


def statements_of(lines):
    """The same of a Python session."""
    result = []
    for line in lines:
        if line.startswith(">>> "):
            result.append((line[4:], []))
        elif result and line.startswith("... ") and not result[-1][1]:
            result[-1] = (result[-1][0] + "\n" + line[4:], [])
        elif result:
            result[-1][1].append(line)
    return result


def plain(line):
    """The line without what may differ between two runs."""
    line = re.sub(r"127\.0\.0\.1:\d+", "ADDRESS", line)
    line = re.sub(r"\d+\.\d+ s\b", "TIME", line)
    line = re.sub(r"[\d.]+ (bytes|KiB|MiB|GiB)", "SIZE", line)
    line = re.sub(r"[\d,]+ messages", "N messages", line)
    # As many as the machine has cores.
    line = re.sub(r"\d+ (block server|thread|processe)s?", r"N \1s", line)
    if re.match(r"\s*(\d+|all)\s+(ADDRESS|[\d,]+)\s", line):
        line = re.sub(r"[\d,]+", "N", line)
    line = re.sub(r"-{2,}", "--", line)
    return re.sub(r"\s+", " ", line).strip()


def same(expected, printed):
    """Whether the lines of a page stand for the lines that were printed."""
    if not expected:
        return not printed
    if expected[0] == "…":
        return any(same(expected[1:], printed[i:]) for i in range(len(printed) + 1))
    if not printed:
        return False
    pattern = ".*".join(re.escape(part) for part in expected[0].split("…"))
    return re.fullmatch(pattern, printed[0]) is not None and same(expected[1:], printed[1:])


def matches(expected, text):
    return same([plain(l) for l in expected if l.strip()], [plain(l) for l in text.split("\n") if l.strip()])


class Shell:
    """bash, a command at a time, in a folder of its own. Whatever a command prints, and its exit code at the end, come
    through pipes: what is waited for is an event, never a time."""

    def __init__(self, folder, environment):
        self.folder = folder
        self.count = 0
        # The pipes of commands that stay in the background: closed only at the end, or they could not print any more.
        self.open = []
        self.bash = subprocess.Popen(["bash", "--norc"], cwd=folder, env=environment, stdin=subprocess.PIPE,
                                     stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True,
                                     start_new_session=True)

    def pipe(self, name):
        path = os.path.join(self.folder, f".{name}{self.count}")
        os.mkfifo(path)
        # Both ways, so that opening does not wait and there is no end before the last writer's.
        self.open.append(os.open(path, os.O_RDWR | os.O_NONBLOCK))
        return path, self.open[-1]

    def run(self, command, expected):
        """Exit code and output."""
        self.count += 1
        background = command.endswith("&")
        body = command[:-1] if background else command
        out_path, out = self.pipe("out")
        code_path, code = self.pipe("code")
        self.bash.stdin.write(f"{{ {body}\n}} >{out_path} 2>&1 " +
                              ("&\n" if background else f"\necho $? >{code_path}\n"))
        self.bash.stdin.flush()
        if background and matches(expected, ""):
            return 0, ""
        printed = b""
        end = time.monotonic() + 60
        with selectors.DefaultSelector() as events:
            events.register(out, selectors.EVENT_READ)
            events.register(code, selectors.EVENT_READ)
            while True:
                ready = {key.fd for key, _ in events.select(max(0, end - time.monotonic()))}
                if not ready:
                    return -1, printed.decode() + "\n(no end after 60 s)"
                if out in ready:
                    printed += os.read(out, 1 << 20)
                    if background and matches(expected, printed.decode(errors="replace")):
                        return 0, printed.decode()
                elif out not in {key.fd for key, _ in events.select(0)}:
                    # Everything was printed before.
                    return int(os.read(code, 100)), printed.decode()

    def close(self):
        """Ends the shell and what it left running, by name of this shell's own session only."""
        try:
            os.killpg(self.bash.pid, signal.SIGTERM)
            self.bash.wait(20)
        except (ProcessLookupError, subprocess.TimeoutExpired):
            pass
        try:
            os.killpg(self.bash.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        for pipe in self.open:
            os.close(pipe)


# Reads statements, a line of JSON each, and answers what each has printed.
PYTHON_SESSION = """
import code, contextlib, io, json, sys
answers, console = sys.stdout, code.InteractiveInterpreter({"__name__": "__console__"})
for line in sys.stdin:
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        if console.runsource(json.loads(line) + "\\n", symbol="single"):
            print("incomplete statement")
    print(json.dumps(out.getvalue()), file=answers, flush=True)
"""


class Python:
    """A Python session, a statement at a time."""

    def __init__(self, folder, environment):
        self.python = subprocess.Popen(["/usr/bin/python3", "-c", PYTHON_SESSION], cwd=folder, env=environment,
                                       stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def run(self, statement):
        """What it printed, tracebacks included."""
        self.python.stdin.write(json.dumps(statement) + "\n")
        self.python.stdin.flush()
        answer = self.python.stdout.readline()
        return json.loads(answer) if answer else "(Python ended)"

    def close(self):
        self.python.kill()
        self.python.wait()


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return str(s.getsockname()[1])


def check_page(page, bin_folder, root):
    """Number of commands run, and what differs."""
    faults, count = [], 0
    folder = tempfile.mkdtemp(prefix="ndmap-docs-")
    environment = dict(os.environ, PATH=bin_folder + os.pathsep + os.environ["PATH"], LC_ALL="C.UTF-8", SOURCE=root)
    environment.pop("NDMAP_COORDINATOR", None)
    environment["PYTHONPATH"] = os.path.join(os.path.dirname(bin_folder), "python")
    port = free_port()
    shell, python = Shell(folder, environment), None
    try:
        for line, fails, name, lines in blocks_of(page):
            if name:
                with open(os.path.join(folder, name), "w", encoding="utf-8") as f:
                    f.write("\n".join(lines) + "\n")
                continue
            for statement, expected in statements_of(lines):
                count += 1
                python = python or Python(folder, environment)
                text = python.run(statement.replace(PAGE_PORT, port))
                if not matches(expected, text):
                    faults.append(f"{page}:{line}: >>> {statement}\n  the page shows:\n" + "\n".join(expected) +
                                  f"\n  it printed:\n{text}")
            for command, expected in commands_of(lines):
                count += 1
                code, text = shell.run(command.replace(PAGE_PORT, port), expected)
                where = f"{page}:{line}: $ {command}"
                if (code != 0) != fails:
                    faults.append(f"{where}\n  exit code {code}, printed:\n{text}")
                elif not matches(expected, text):
                    faults.append(f"{where}\n  the page shows:\n" + "\n".join(expected) + f"\n  it printed:\n{text}")
    finally:
        if python:
            python.close()
        shell.close()
        shutil.rmtree(folder, ignore_errors=True)
    return count, faults


PROGRAMS = ["ndmap", "ndmap-server", "ndmap-coordinator", "ndmap-picture"]
# Of programs that are not ours.
# Those of apt-get, cmake and buf.
FOREIGN_FLAGS = {"--no-install-recommends", "--component", "--install", "--prefix", "--data", "--http", "--protocol"}
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


def known_flags(bin_folder):
    """The flags that the programs' own help lists."""
    def help_of(*command):
        run = subprocess.run([os.path.join(bin_folder, command[0]), *command[1:], "--help"], stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True, check=False)
        return run.stdout
    def helps_of(*command):
        text = help_of(*command)
        below = re.findall(r"^  ([a-z]+) {2,}", text.partition("Subcommands:")[2], re.MULTILINE)
        return [text] + [one for name in below for one in helps_of(*command, name)]
    texts = [text for program in PROGRAMS for text in helps_of(program)]
    return set(FLAG.findall(" ".join(texts))) | FOREIGN_FLAGS


def check_flags(page, known):
    text = re.sub(r"```sh\n.*?```", "", open(page, encoding="utf-8").read(), flags=re.DOTALL)
    # What a page quotes as refused is no flag.
    text = re.sub(r"^\$ .*--dept .*$|not expected: .*$", "", text, flags=re.MULTILINE)
    return [f"{page}: no program has a flag {flag}" for flag in sorted(set(FLAG.findall(text)) - known)]


def check_links(root):
    faults = []
    pages = [os.path.join(root, name) for name in ("README.md", "CHANGELOG.md")]
    for folder, _, names in os.walk(os.path.join(root, "docs")):
        pages += [os.path.join(folder, name) for name in names if name.endswith(".md")]
    for page in pages:
        text = re.sub(r"```.*?```", "", open(page, encoding="utf-8").read(), flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
            if "://" not in target and not os.path.exists(os.path.join(os.path.dirname(page), target)):
                faults.append(f"{page}: its link to {target} leads nowhere")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", required=True)
    parser.add_argument("pages", nargs="+")
    options = parser.parse_args()
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    known = known_flags(options.bin)
    links = check_links(root)
    print("\n".join(links))
    failed = bool(links)
    for page in options.pages:
        count, faults = check_page(page, os.path.abspath(options.bin), root)
        faults += check_flags(page, known)
        if count == 0:
            faults.append(f"{page}: no command is marked to be run")
        for fault in faults:
            print(fault)
        print(f"{page}: {count} commands, {len(faults)} faults", flush=True)
        failed = failed or bool(faults)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
