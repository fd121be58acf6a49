// SPDX-License-Identifier: GPL-3.0-or-later
// What a Flamenco Manager gives to job types, as its documentation has it: flamenco.js JOB_TYPE.js SETTINGS -> the tasks.
// Refuses what the manager would refuse: unknown settings, missing ones, commands and tasks of unknown kinds.

const fs = require("fs");
const vm = require("vm");

const TASK_TYPES = ["blender", "ffmpeg", "file-management", "misc"];
const SETTING_TYPES = { string: "string", int32: "number", float: "number", bool: "boolean" };
const COMMANDS = { exec: { exe: v => typeof v === "string",
                           args: v => Array.isArray(v) && v.every(a => typeof a === "string") } };

function check(condition, text) {
    if (!condition) {
        throw new Error(text);
    }
}

const author = {
    Task(name, type) {
        check(TASK_TYPES.includes(type), "task type " + type);
        return {
            name, type, commands: [], dependencies: [],
            addCommand(command) { this.commands.push(command); },
            addDependency(task) { this.dependencies.push(task); },
        };
    },
    Command(name, parameters) {
        check(name in COMMANDS, "command " + name);
        for (const key of Object.keys(COMMANDS[name])) {
            check(COMMANDS[name][key](parameters[key]), name + ": " + key);
        }
        check(Object.keys(parameters).every(key => key in COMMANDS[name]), name + ": unknown parameter");
        return { name, parameters };
    },
};

const sandbox = vm.createContext({ author, print: () => {} });
vm.runInContext(fs.readFileSync(process.argv[2], "utf8")
    + "\n;this.exported = { JOB_TYPE, compileJob };", sandbox);
const { JOB_TYPE, compileJob } = sandbox.exported;

check(typeof JOB_TYPE.label === "string", "label");
const given = JSON.parse(process.argv[3]);
const settings = {};
for (const setting of JOB_TYPE.settings) {
    const { key, type } = setting;
    check(type in SETTING_TYPES, key + ": type " + type);
    settings[key] = key in given ? given[key] : setting.default;
    check(settings[key] !== undefined || !setting.required, key + " is required");
    check(settings[key] === undefined || typeof settings[key] === SETTING_TYPES[type], key + ": not " + type);
    check(!setting.choices || setting.choices.includes(settings[key]), key + ": no such choice");
}
check(Object.keys(given).every(key => key in settings), "unknown setting");

const tasks = [];
compileJob({ settings, addTask(task) { tasks.push(task); } });
console.log(JSON.stringify(tasks.map(task => ({
    name: task.name,
    type: task.type,
    commands: task.commands,
    dependencies: task.dependencies.map(other => tasks.indexOf(other)),
}))));
