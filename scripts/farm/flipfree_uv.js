// SPDX-License-Identifier: GPL-3.0-or-later
// Job type for Flamenco 3: put this file into the folder `scripts` beside flamenco-manager (docs/batch.md).
//
// Every task is a share of the models with results of its own, with which it goes on when its worker was lost and the task is
// queued again; the last task joins them.

const JOB_TYPE = {
    label: "Flipfree UV",
    description: "Flip-free UV maps for folders of models, with a line of results for each",
    settings: [
        { key: "inputs", type: "string", required: true,
          description: "Files, folders and patterns that all workers can reach, one a line or parted by spaces (names with spaces in quotes)" },
        { key: "out", type: "string", subtype: "dir_path", required: true,
          description: "Folder of the outputs, which have the inputs' names" },
        { key: "results", type: "string", subtype: "dir_path", required: true,
          description: "Folder of the results: a file for each share, and results.jsonl" },
        { key: "command", type: "string", default: "unwrap",
          choices: ["unwrap", "improve", "pack", "conformal", "seamless", "field", "match", "check"],
          description: "What is done with every model" },
        { key: "shares", type: "int32", default: 8, propargs: { min: 1, max: 10000 },
          description: "Number of tasks" },
        { key: "jobs", type: "int32", default: 1, propargs: { min: 1, max: 256 },
          description: "Models at a time on one worker" },
        { key: "timeout", type: "float", default: 600.0, propargs: { min: 0.0 },
          description: "Most seconds for one model; 0 is no limit" },
        { key: "memory", type: "float", default: 0.0, propargs: { min: 0.0 },
          description: "Most megabytes for one model; 0 is no limit" },
        { key: "options", type: "string", default: "",
          description: "Further options, such as --suffix .obj" },
        { key: "program", type: "string", default: "{blender} -b -c flipfree", visible: "submission",
          description: "How flipfree is called on the workers; python3 -m flipfree does without Blender" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const program = words(settings.program);
    const inputs = words(settings.inputs);
    if (program.length === 0 || inputs.length === 0) {
        throw new Error("program and inputs must not be empty");
    }
    if (!(settings.shares >= 1)) {
        throw new Error("shares must be 1 at least");
    }

    const join = author.Task("join results", "misc");
    const files = [];
    for (let i = 1; i <= settings.shares; i++) {
        const results = settings.results + "/" + i + "-of-" + settings.shares + ".jsonl";
        files.push(results);
        const share = author.Task("share " + i + " of " + settings.shares, "misc");
        share.addCommand(author.Command("exec", {
            exe: program[0],
            args: program.slice(1).concat(shareArguments(settings, inputs, i, results)),
        }));
        job.addTask(share);
        join.addDependency(share);
    }
    join.addCommand(author.Command("exec", {
        exe: "sh",
        args: ["-c", 'out=$1; shift; cat "$@" > "$out.part" && mv "$out.part" "$out"', "sh",
               settings.results + "/results.jsonl"].concat(files),
    }));
    job.addTask(join);
}

function shareArguments(settings, inputs, index, results) {
    const given = [settings.command].concat(inputs);
    if (settings.command !== "check") {
        given.push("--out", settings.out);
    }
    given.push("--shard", index + "/" + settings.shares, "--json", results, "--resume");
    given.push("--jobs", String(settings.jobs));
    if (settings.timeout > 0) {
        given.push("--timeout", String(settings.timeout));
    }
    if (settings.memory > 0) {
        given.push("--memory", String(settings.memory));
    }
    return given.concat(words(settings.options));
}

// Parted at white space; quotes hold together.
function words(text) {
    const found = String(text || "").match(/"[^"]*"|'[^']*'|[^\s"']+/g) || [];
    return found.map(word => word.replace(/^["']|["']$/g, ""));
}
