//! The page in a real browser, on a desktop's screen and on a telephone's.
//!
//! `LOOKMATCH_REPORT` names the folder of a report to look at instead of the example, and `LOOKMATCH_SCREENSHOTS` one for screenshots.

mod example;

use std::env;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread::sleep;
use std::time::Duration;

use headless_chrome::browser::default_executable;
use headless_chrome::protocol::cdp::Page::CaptureScreenshotFormatOption::Png;
use headless_chrome::protocol::cdp::types::Event;
use headless_chrome::protocol::cdp::{Emulation, Input, Network, Page};
use headless_chrome::{Browser, LaunchOptions, Tab};
use serde::de::DeserializeOwned;
use serde_json::{Value as Json, json};
use tempfile::TempDir;

const DESKTOP: (u32, u32) = (1440, 900);
const TELEPHONE: (u32, u32) = (390, 844);

/// A report's page, opened with an eye on all that goes wrong.
struct Opened {
    tab: Arc<Tab>,
    complaints: Arc<Mutex<Vec<String>>>,
    width: u32,
    _browser: Browser,
    _example: Option<TempDir>,
}

impl Opened {
    fn new((width, height): (u32, u32), has_script: bool) -> Self {
        let (page, example) = report();
        let program = default_executable().expect("chromium is needed: apt-get install chromium");
        // Its sandbox needs rights that containers lack; the page is our own.
        let options = LaunchOptions::default_builder().path(Some(program)).sandbox(false).build().unwrap();
        let browser = Browser::new(options).unwrap();
        let tab = browser.new_tab().unwrap();
        tab.set_default_timeout(Duration::from_secs(60));
        let is_telephone = width < 500;
        tab.call_method(command::<Emulation::SetDeviceMetricsOverride>(
            json!({"width": width, "height": height, "deviceScaleFactor": 1.0, "mobile": is_telephone}),
        ))
        .unwrap();
        tab.call_method(command::<Emulation::SetTouchEmulationEnabled>(json!({"enabled": is_telephone})))
            .unwrap();
        tab.call_method(command::<Emulation::SetScriptExecutionDisabled>(json!({"value": !has_script})))
            .unwrap();
        let complaints = Arc::new(Mutex::new(Vec::new()));
        listen(&tab, complaints.clone());
        tab.navigate_to(&format!("file://{}", page.display())).unwrap().wait_until_navigated().unwrap();
        Self { tab, complaints, width, _browser: browser, _example: example }
    }

    /// The value of an expression in the page.
    fn value(&self, expression: &str) -> Json {
        let whole = format!("JSON.stringify({expression})");
        let found =
            self.tab.evaluate(&whole, true).unwrap().value.unwrap_or_else(|| panic!("{expression}: nothing"));
        serde_json::from_str(found.as_str().unwrap()).unwrap()
    }

    /// Where the source ends in the first comparison, in percent of the width, as it is drawn.
    fn line(&self) -> f64 {
        self.value(
            "(() => {
                const image = document.querySelector('.stage .above');
                const clip = getComputedStyle(image).clipPath.match(/inset\\(0px (.*?) 0px 0px\\)/)[1];
                const percent = document.querySelector('.stage input').value;
                const line = document.querySelector('.stage .line').getBoundingClientRect();
                const box = image.getBoundingClientRect();
                const drawn = 100 * ((line.left + line.right) / 2 - box.left) / box.width;
                if (Math.abs(drawn - percent) > 1) throw new Error(`line at ${drawn}, slider at ${percent}`);
                return 100 - Number(clip.replace(/calc\\(100% - (.*)%\\)/, (_, p) => 100 - p).replace('%', ''));
            })()",
        )
        .as_f64()
        .unwrap()
    }

    /// A place on the first stage, as shares of its width and height, in pixels of the window.
    fn on_stage(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.value(
            "document.querySelector('.stage').scrollIntoView({block: 'center', behavior: 'instant'})||1",
        );
        let part = |side: &str| {
            self.value(&format!("document.querySelector('.stage').getBoundingClientRect().{side}"))
        };
        let part = |side: &str| part(side).as_f64().unwrap();
        [part("left") + u * part("width"), part("top") + v * part("height")]
    }

    fn touch(&self, kind: &str, points: &[[f64; 2]]) {
        let points: Vec<Json> = points.iter().map(|[x, y]| json!({"x": x, "y": y})).collect();
        self.tab
            .call_method(command::<Input::DispatchTouchEvent>(json!({"type": kind, "touchPoints": points})))
            .unwrap();
    }

    /// What all sizes have in common.
    fn check(&self) {
        // A telephone widens its window with the page: what counts is the width of its screen.
        let width = self.width;
        let scroll = self.value("document.documentElement.scrollWidth").as_u64().unwrap();
        let wide = self.value(&format!(
            "[...document.querySelectorAll('main *')].filter(e => !e.closest('.scroll') && !e.closest('.hidden') && \
             e.getBoundingClientRect().right > {width} + 1).map(e => e.tagName + '.' + e.className)"
        ));
        assert!(scroll <= width.into(), "the page scrolls sideways: {scroll} of {width}; {wide}");
        assert_eq!(wide, json!([]));
        assert!(self.value("document.images.length").as_u64() > Some(4));
        assert_eq!(self.broken(), json!([]));
        assert_eq!(self.value("document.querySelectorAll('.wipe[hidden]').length"), 0);
        let lost = "[...document.querySelectorAll('a')].filter(a => !document.querySelector(a.getAttribute('href'))).length";
        assert_eq!(self.value(lost), 0);
        let nameless = "[...document.images].filter(i => !i.alt && !i.closest('.stage')).length";
        assert_eq!(self.value(nameless), 0);
    }

    /// What is told of pictures that cannot be shown.
    fn broken(&self) -> Json {
        let shown = "i.decode().then(() => i.naturalWidth > 0 && i.clientWidth > 0 ? '' : i.alt, () => i.alt + ' is damaged')";
        let all = format!("Promise.all([...document.images].map(i => {shown}))");
        let told = format!("{all}.then(told => JSON.stringify(told.filter(Boolean)))");
        let told = self.tab.evaluate(&told, true).unwrap().value.unwrap();
        serde_json::from_str(told.as_str().unwrap()).unwrap()
    }

    /// All texts are dark or bright enough on what lies behind them, by WCAG 2.2's level AA, by day and by night.
    fn check_contrast(&self) {
        for scheme in ["light", "dark"] {
            let features = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
            self.tab.call_method(command::<Emulation::SetEmulatedMedia>(features)).unwrap();
            assert_eq!(
                self.value(&format!("matchMedia('(prefers-color-scheme: {scheme})').matches")),
                json!(true)
            );
            let [texts, faint] = [0, 1].map(|k| self.value(&format!("({CONTRAST})()[{k}]")));
            assert!(texts.as_u64() > Some(50), "{texts} texts");
            assert_eq!(faint, json!([]), "{scheme}");
            self.screenshots(&format!("{scheme}-{}", self.width));
        }
    }

    fn screenshots(&self, name: &str) {
        let Some(folder) = env::var_os("LOOKMATCH_SCREENSHOTS").map(PathBuf::from) else { return };
        let height = self.value("document.documentElement.scrollHeight").as_f64().unwrap();
        let clip = Page::Viewport { x: 0.0, y: 0.0, width: self.width.into(), height, scale: 1.0 };
        let whole = json!({"format": "png", "clip": clip, "captureBeyondViewport": true});
        let data = self.tab.call_method(command::<Page::CaptureScreenshot>(whole)).unwrap().data;
        let bytes = base64::Engine::decode(&base64::prelude::BASE64_STANDARD, data).unwrap();
        std::fs::write(folder.join(format!("{name}-whole.png")), bytes).unwrap();
        self.value("scrollTo({top: 0, behavior: 'instant'})||1");
        let seen = self.tab.capture_screenshot(Png, None, None, true).unwrap();
        std::fs::write(folder.join(format!("{name}.png")), seen).unwrap();
    }

    fn finish(self) {
        sleep(Duration::from_millis(300));
        let complaints = self.complaints.lock().unwrap();
        assert!(complaints.is_empty(), "{complaints:#?}");
    }
}

/// How many texts there are, and those of too little contrast.
const CONTRAST: &str = r"() => {
    const channels = (colour) => {
        const is_share = colour.startsWith('color(srgb');
        const [r, g, b, a = 1] = colour.match(/\d[\d.e-]*/g).map(Number);
        return [...[r, g, b].map((v) => (is_share ? v : v / 255)), a];
    };
    const luminance = (colour) => {
        const [r, g, b] = colour.map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = (element) => {
        for (; element; element = element.parentElement) {
            const colour = channels(getComputedStyle(element).backgroundColor);
            if (colour[3] > 0) return colour;
        }
        return [1, 1, 1];
    };
    const has_text = (e) => [...e.childNodes].some((n) => n.nodeType === Node.TEXT_NODE && n.data.trim());
    const texts = [...document.querySelectorAll('body *')].filter((e) => !e.closest('script, .stage') && has_text(e));
    const faint = texts.map((e) => {
        const [a, b] = [channels(getComputedStyle(e).color), behind(e)].map(luminance);
        const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        return ratio >= 4.5 ? null : `${e.tagName} '${e.textContent.slice(0, 40)}': ${ratio}`;
    });
    return [texts.length, faint.filter(Boolean)];
}";

/// A command to the browser: what it does not name is left to the browser.
fn command<C: DeserializeOwned>(fields: Json) -> C {
    serde_json::from_value(fields).unwrap()
}

/// The page to look at.
fn report() -> (PathBuf, Option<TempDir>) {
    if let Some(folder) = env::var_os("LOOKMATCH_REPORT") {
        return (Path::new(&folder).join("index.html").canonicalize().unwrap(), None);
    }
    let folder = tempfile::tempdir().unwrap();
    example::write_pictures(folder.path());
    lookmatch_reproduce::write(&example::run(), folder.path()).unwrap();
    // With no pictures beside it, it has to have them in itself.
    let alone = tempfile::tempdir().unwrap();
    std::fs::copy(folder.path().join("index.html"), alone.path().join("index.html")).unwrap();
    (alone.path().join("index.html"), Some(alone))
}

/// Collects errors, and requests for anything but the page.
fn listen(tab: &Tab, complaints: Arc<Mutex<Vec<String>>>) {
    tab.enable_log().unwrap().enable_runtime().unwrap();
    tab.call_method(command::<Network::Enable>(json!({}))).unwrap();
    let listener = move |event: &Event| {
        let complaint = match event {
            Event::LogEntryAdded(entry) => Some(entry.params.entry.text.clone()),
            Event::RuntimeConsoleAPICalled(call) => Some(format!("{:?}", call.params.args)),
            Event::RuntimeExceptionThrown(thrown) => Some(format!("{:?}", thrown.params.exception_details)),
            Event::NetworkRequestWillBeSent(sent) => {
                let url = &sent.params.request.url;
                let is_own =
                    url.starts_with("data:") || url.starts_with("file:") && url.ends_with("/index.html");
                (!is_own).then(|| format!("request of {url}"))
            }
            _ => None,
        };
        complaints.lock().unwrap().extend(complaint);
    };
    tab.add_event_listener(Arc::new(listener)).unwrap();
}

#[test]
#[ignore = "needs chromium"]
fn a_desktop_shows_all_and_the_keyboard_moves_the_wipe() {
    let opened = Opened::new(DESKTOP, true);
    opened.check();
    opened.check_contrast();
    assert_eq!(opened.line(), 50.0);
    let [x, y] = opened.on_stage([0.3, 0.4]);
    opened.tab.click_point(headless_chrome::browser::tab::point::Point { x, y }).unwrap();
    let line = opened.line();
    assert!((29.0..=31.0).contains(&line), "the line is where the mouse was: {line}");
    opened.tab.press_key("ArrowRight").unwrap();
    assert_eq!(opened.line(), line + 1.0);
    opened.tab.press_key("End").unwrap();
    assert_eq!(opened.line(), 100.0);
    let told = opened.value("document.querySelector('.stage input').getAttribute('aria-valuetext')");
    assert!(told.as_str().unwrap().starts_with("100 % source, 0 % "), "{told}");
    // Another picture below it.
    let below = "document.querySelector('.stage .below').src";
    let first = opened.value(below);
    opened.value(
        "document.querySelectorAll('.comparison')[0].querySelectorAll('.wipe [type=radio]')[1].click()||1",
    );
    assert_ne!(opened.value(below), first);
    assert_eq!(
        opened.value(below),
        opened.value("document.querySelectorAll('.comparison img.picture')[2].src")
    );
    opened.finish();
}

#[test]
#[ignore = "needs chromium"]
fn a_telephone_shows_all_and_a_finger_moves_the_wipe() {
    let opened = Opened::new(TELEPHONE, true);
    opened.check();
    opened.check_contrast();
    let [from, to] = [opened.on_stage([0.5, 0.5]), opened.on_stage([0.2, 0.5])];
    opened.touch("touchStart", &[from]);
    for k in 1..=4 {
        let share = f64::from(k) / 4.0;
        opened.touch("touchMove", &[[from[0] + share * (to[0] - from[0]), from[1]]]);
    }
    opened.touch("touchEnd", &[]);
    let line = opened.line();
    assert!((18.0..=22.0).contains(&line), "the line is where the finger was: {line}");
    opened.finish();
}

#[test]
#[ignore = "needs chromium"]
fn without_its_script_all_pictures_are_shown() {
    let opened = Opened::new(DESKTOP, false);
    assert_eq!(opened.value("document.querySelectorAll('.stage img').length"), 0);
    assert_eq!(opened.broken(), json!([]));
    assert!(opened.value("document.images.length").as_u64() > Some(4));
    opened.finish();
}
