// program.js: what the test of the page and the maker of its pictures share: the program, the browser, a page.
'use strict';

const { spawn } = require('node:child_process');
const fs = require('node:fs');
const SKIP = 77, CHROMIUM = process.env.OM_CHROMIUM || '/usr/bin/chromium';

let playwright = null;
try { playwright = require('playwright-core'); } catch { /* skipped below */ }
if (!playwright || !fs.existsSync(CHROMIUM)) {
  console.log(`skip: ${playwright ? CHROMIUM : 'playwright-core'} is not installed`);
  process.exit(SKIP);
}

const errors = [];  // of any page
const children = [];

// The program, once it says where its page is.
function start(program, args) {
  const child = spawn(program, ['view', ...args, '-q'], { stdio: ['ignore', 'pipe', 'inherit'] });
  children.push(child);
  return new Promise((resolve, reject) => {
    let out = '';
    child.stdout.on('data', (data) => {
      out += data;
      const url = out.match(/http:\S+/);
      if (url) resolve({ child, url: url[0] });
    });
    child.on('exit', () => reject(new Error('the program ended: ' + out)));
  });
}

async function open(browser, url, size) {
  const page = await browser.newPage({ viewport: size });
  page.on('pageerror', (e) => errors.push(e.message));
  page.on('console', (m) => { if (m.type() === 'error' && !/ERR_CONNECTION|WebSocket/.test(m.text())) errors.push(m.text()); });
  await page.goto(url);
  return page;
}

// Run in a browser whose WebGL is software, and end what was started.
async function run(main) {
  const browser = await playwright.chromium.launch({ executablePath: CHROMIUM,
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'] });
  let error = null;
  try {
    await main(browser);
  } catch (e) {
    error = e;
  }
  for (const child of children) child.kill('SIGKILL');
  await browser.close();
  if (error) console.log('FAILED: ' + error.message);
  process.exitCode = error ? 1 : 0;
}

module.exports = { start, open, run, errors };
